# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Boxes seen from a direction, and as SVG paths; lengths in m, and in drawing units.

A drawing is UNITS wide; a box is drawn as those of its faces that can be seen, in three lights.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import cos, hypot, radians, sin

from slap_ros.core import VisibleBody
from slap_ros.geometry.pose import Pose, Vector, dot, rotate

UNITS = 1000  # width of a drawing; whole units are fine enough on any screen
EDGE_ON = 1e-6  # cosine at which a face can no longer be seen
LIGHT = (-0.35, -0.5, 0.79)  # where it comes from
LIT, SHADED = 0.6, 0.2  # cosines of a face's normal with it
FARTHEST_M = 1e4  # from the origin, of what is drawn
LEAST_LENGTH = 0.5  # of a quaternion that is meant to be one
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

Point = tuple[float, float]  # m, to the right and up
Face = tuple[float, list[Vector]]  # cosine with the light; corners in order


@dataclass(frozen=True)
class Projection:
    """A direction to look from."""

    name: str
    right: Vector  # of length 1, as is up
    up: Vector

    @property
    def toward(self) -> Vector:
        """The direction toward the viewer, of length 1."""
        (a, b, c), (d, e, f) = self.right, self.up
        return (b * f - c * e, c * d - a * f, a * e - b * d)

    def project(self, point: Vector) -> Point:
        """Where a point of the world is seen."""
        return dot(self.right, point), dot(self.up, point)

    def depth(self, point: Vector) -> float:
        """How near to the viewer a point is, m."""
        return dot(self.toward, point)


def _oblique(turn: float, height: float) -> Projection:
    """The view from the robot's right and above; angles from its right side and the ground, rad."""
    up = (-sin(turn) * sin(height), cos(turn) * sin(height), cos(height))
    return Projection("From the front right", (cos(turn), sin(turn), 0.0), up)


OBLIQUE = _oblique(radians(38.0), radians(28.0))
SIDE = Projection("From the side", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
TOP = Projection("From above", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class Canvas:
    """The part of a view that is drawn, in m, with the scale."""

    left: float
    top: float
    width: float
    height: float

    @classmethod
    def around(cls, points: Iterable[Point], margin: float) -> Canvas:
        """A canvas around points, with a margin that is a share of the greater extent."""
        xs, ys = zip(*points, strict=True)
        width, height = max(xs) - min(xs), max(ys) - min(ys)
        rim = margin * max(width, height) or 1.0
        return cls(min(xs) - rim, max(ys) + rim, width + 2 * rim, height + 2 * rim)

    @property
    def scale(self) -> float:
        """Drawing units per metre."""
        return UNITS / self.width

    @property
    def units_high(self) -> int:
        """The height in drawing units."""
        return round(self.height * self.scale)

    def path(self, points: Iterable[Point], closed: bool = True) -> str:
        """The path of straight lines through points."""
        at = [
            (round((x - self.left) * self.scale), round((self.top - y) * self.scale))
            for x, y in points
        ]
        return "M" + " ".join(f"{x} {y}" for x, y in at) + ("Z" if closed else "")


def box_paths(body: VisibleBody, view: Projection, canvas: Canvas) -> tuple[str, str, str]:
    """The visible faces of a box as paths: all of them, those in the light, those in the shade.

    Args:
        body: Body that is drawn as a box.
        view: Projection that the body is seen in.
        canvas: Part of the view that is drawn, with the scale.
    """
    drawn = [
        (light, canvas.path(map(view.project, corners))) for light, corners in _seen(body, view)
    ]
    return (
        "".join(path for _, path in drawn),
        "".join(path for light, path in drawn if light > LIT),
        "".join(path for light, path in drawn if light < SHADED),
    )


def corners(body: VisibleBody) -> list[Vector]:
    """The corners of a box, or of the one around a body of triangles."""
    pose = pose_of(body)
    xs, ys, zs = extents(body)
    return [pose.apply(corner) for corner in product(xs, ys, zs)]


def extents(body: VisibleBody) -> list[tuple[float, float]]:
    """How far a body reaches along its own axes, from and to, m."""
    if body.triangles:
        return [(min(values), max(values)) for values in zip(*body.triangles, strict=True)]
    return [(-size / 2, size / 2) for size in body.size]


def box_triangles(body: VisibleBody) -> list[tuple[Vector, Vector, Vector]]:
    """The twelve triangles of a box, the two of a face after one another, m."""
    pose, half = pose_of(body), [size / 2 for size in body.size]
    found = []
    for axis, sign in product(range(3), (-1.0, 1.0)):
        a, b, c, d = map(pose.apply, _face(half, axis, sign))
        found += [(a, b, c), (a, c, d)]
    return found


def _face(half: Sequence[float], axis: int, sign: float) -> list[Vector]:
    """The corners of a face of a box in order, in its own frame, m."""
    across, along = (axis + 1) % 3, (axis + 2) % 3
    local = []
    for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        corner = [0.0, 0.0, 0.0]
        corner[axis] = sign * half[axis]
        corner[across], corner[along] = u * half[across], v * half[along]
        local.append((corner[0], corner[1], corner[2]))
    return local


def drawable(bodies: Iterable[VisibleBody]) -> Iterator[VisibleBody]:
    """The bodies that can be drawn: any values may have been recorded or displayed."""
    for body in bodies:
        shape = (number for corner in body.triangles for number in corner)
        numbers = (*body.position, *body.quaternion, *body.size, *body.colour, *shape)
        if all(map(is_near, numbers)) and hypot(*body.quaternion) > LEAST_LENGTH:
            yield body


def is_near(number: float) -> bool:
    """Whether something in m, or of magnitude 1, can be drawn; False for NaN."""
    return abs(number) <= FARTHEST_M


def _seen(body: VisibleBody, view: Projection) -> Iterator[Face]:
    pose, toward = pose_of(body), view.toward
    half = [size / 2 for size in body.size]
    for axis, sign in product(range(3), (-1.0, 1.0)):
        normal = rotate(pose.quaternion, _scaled(AXES[axis], sign))
        if dot(normal, toward) > EDGE_ON:
            local = _face(half, axis, sign)
            yield dot(normal, LIGHT), [pose.apply(corner) for corner in local]


def pose_of(body: VisibleBody) -> Pose:
    """Where a body is, with a quaternion of length 1."""
    length = hypot(*body.quaternion)  # colours and poses of markers are what someone recorded
    x, y, z, w = (part / length for part in body.quaternion)
    return Pose(body.position, (x, y, z, w))


def _scaled(v: Vector, factor: float) -> Vector:
    return (v[0] * factor, v[1] * factor, v[2] * factor)
