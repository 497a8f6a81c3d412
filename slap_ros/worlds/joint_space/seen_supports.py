# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What bodies at rest stand on, where a camera says only roughly how far away each of them is.

A tag that something covers along an edge seems smaller, and so further away than it is, by up to
eight centimetres; nothing makes it seem as much nearer. A block on another one may so seem to be
inside it, inside the table, or on the table behind it. Of all ways in which everything stands on
something and nothing is inside anything, the one that asks for the least errors is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector, conjugate, rotate
from slap_ros.worlds.settling import DISTANCE_ERROR, FLOATING, levelled

SEEN_FLOATING = 0.024  # m, the same as FLOATING for what a camera sees; less than half a block
LESS_LIKELY = 2.0  # times as much as too far away is what a camera sees too near
STEEP = 0.3  # sine of the least angle of a line of sight with the table that says where things are
APART = 0.005  # m, by which neither of two bodies reaches into the other, nor stands off it
OVER_EDGE = 0.01  # m, by which the middle of what stands on something may be beyond its edge
CONFLICT = 1.0  # m, more than all errors: of a body that stands on nothing, or inside another

Option = tuple[Pose, float]  # a pose, and how much of an error it asks for, m


class StandingBody(Protocol):
    """A body that stands on what is below it."""

    def at(self, pose: Pose) -> OrientedBox:
        """The box around the body at a pose."""
        ...

    def stands_on(self, down: Vector) -> bool:
        """Whether it stands on a plane without turning, with an axis of its own downwards."""
        ...


class SupportSearch:
    """Where bodies stand that were measured at rest, the lowest first.

    Args:
        measured: Pose of each body at rest in the base's frame, by index among the bodies.
        bodies: The free bodies of the scene.
        eyes: Where the camera is that saw a body, base's frame, for those that a camera saw.
    """

    def __init__(
        self,
        measured: Mapping[int, Pose],
        bodies: Sequence[StandingBody],
        eyes: Mapping[int, Vector],
    ) -> None:
        self._measured, self._bodies, self._eyes = measured, bodies, eyes
        self._error = math.inf
        self._best: dict[int, Pose] = {}

    def best(self, order: Sequence[int], fixed: Sequence[OrientedBox]) -> dict[int, Pose]:
        """Poses that ask for the least errors.

        Args:
            order: Indices of all measured bodies, the lowest first.
            fixed: Boxes of what does not move, base's frame.

        Returns:
            A pose for each of them, by its index.
        """
        self._place(order, list(fixed), {}, 0.0)
        return self._best

    def _place(
        self, order: Sequence[int], below: list[OrientedBox], poses: dict[int, Pose], error: float
    ) -> None:
        if error >= self._error:
            return
        if not order:
            self._best, self._error = poses, error
            return
        first, *others = order
        for pose, more in self._options(first, below):
            placed = [*below, self._bodies[first].at(pose)]
            self._place(others, placed, poses | {first: pose}, error + more)

    def _options(self, i: int, below: Sequence[OrientedBox]) -> list[Option]:
        measured, body, eye = self._measured[i], self._bodies[i], self._eyes.get(i)
        pose = levelled(measured)
        if pose is None or not body.stands_on(_down(pose)):
            return [(measured, 0.0)]
        if eye is None:
            return [(_put_down(pose, body, below) or measured, 0.0)]
        supported = _in_sight(pose, body, below, eye)
        return sorted([*supported, (measured, CONFLICT)], key=lambda option: option[1])


def _down(pose: Pose) -> Vector:
    """Which of its own axes a body with a vertical one points downwards."""
    x, y, z = (round(part) for part in rotate(conjugate(pose.quaternion), (0.0, 0.0, -1.0)))
    return (float(x), float(y), float(z))


def _put_down(pose: Pose, body: StandingBody, below: Sequence[OrientedBox]) -> Pose | None:
    """The pose on the highest top near the body's bottom, if there is one."""
    box = body.at(pose)  # whose middle need not be the body's origin
    near = [other.top for other in below if _is_over(box, other, min(box.half))]
    near = [top for top in near if abs(box.bottom - top) <= FLOATING]
    if not near:
        return None
    x, y, z = pose.position
    return Pose((x, y, z + (max(near) - box.bottom)), pose.quaternion)


def _in_sight(
    pose: Pose, body: StandingBody, below: Sequence[OrientedBox], eye: Vector
) -> Iterator[Option]:
    """The poses on what the body may stand on, if it was seen at a wrong distance."""
    bottom = body.at(pose).bottom
    highest = max(SEEN_FLOATING, DISTANCE_ERROR * _steepness(pose.position, eye))
    for top in {other.top for other in below}:
        rise = top - bottom
        if -SEEN_FLOATING <= rise <= highest:
            raised = Pose(_raised(pose.position, rise, eye), pose.quaternion)
            box = body.at(raised)
            if any(_stands_on(box, other) for other in below):
                inside = any(_share_space(box, other) for other in below)
                yield raised, _unlikeliness(rise) + (CONFLICT if inside else 0.0)


def _unlikeliness(rise: float) -> float:
    """Of a height, m, by which something would have been seen too low, and so too far away."""
    return rise if rise >= 0.0 else -LESS_LIKELY * rise


def _stands_on(box: OrientedBox, other: OrientedBox) -> bool:
    return abs(box.bottom - other.top) <= APART and _is_over(box, other, OVER_EDGE)


def _share_space(box: OrientedBox, other: OrientedBox) -> bool:
    return box.shrunk(APART).overlaps(other.shrunk(APART))


def _is_over(box: OrientedBox, other: OrientedBox, reach: float) -> bool:
    """Whether a box's middle is over another one, or beside it by less than a reach, m."""
    middle_x, middle_y, _ = box.pose.position
    x, y, z = other.pose.inverse().apply((middle_x, middle_y, other.pose.position[2]))
    return all(abs(a) <= half + reach for a, half in zip((x, y, z), other.half, strict=True))


def _steepness(point: Vector, eye: Vector) -> float:
    """Sine of the angle of a line of sight with the table; 0 where it is too flat to tell."""
    sight = [a - b for a, b in zip(point, eye, strict=True)]
    sine = -sight[2] / (math.hypot(*sight) or 1.0)
    return sine if sine >= STEEP else 0.0


def _raised(point: Vector, rise: float, eye: Vector) -> Vector:
    """A point raised by some metres: along the line of sight of a camera that looks down on it."""
    x, y, z = point
    if not _steepness(point, eye):
        return (x, y, z + rise)
    sight = [a - b for a, b in zip(point, eye, strict=True)]
    part = rise / sight[2]
    return (x + part * sight[0], y + part * sight[1], z + rise)
