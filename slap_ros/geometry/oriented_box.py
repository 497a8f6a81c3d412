# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Oriented boxes: do they overlap, is a ball near one."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

from slap_ros.geometry.pose import Pose, Vector, conjugate, multiply, rotate, rotation_matrix

UP: Vector = (0.0, 0.0, 1.0)
PARALLEL = 1e-9  # edges whose cross product is shorter than this span no axis of their own


class OrientedBox(NamedTuple):
    """A box: the pose of its centre, and half its edges in m."""

    pose: Pose
    half: Vector

    def at(self, frame: Pose) -> OrientedBox:
        """The box seen from outside, where the frame that it is given in is at a pose."""
        return OrientedBox(frame.compose(self.pose), self.half)

    def shrunk(self, depth: float) -> OrientedBox:
        """The box less a layer of ``depth`` m; what is thinner than that is left as a sheet."""
        x, y, z = self.half
        return OrientedBox(
            self.pose, (max(x - depth, 0.0), max(y - depth, 0.0), max(z - depth, 0.0))
        )

    def grown(self, margin: float) -> OrientedBox:
        """The box with a layer of ``margin`` m around it."""
        x, y, z = self.half
        return OrientedBox(self.pose, (x + margin, y + margin, z + margin))

    @property
    def radius(self) -> float:
        """Half the box's diagonal, m."""
        return math.hypot(*self.half)

    def half_extent(self, axis: Vector) -> float:
        """How far the box reaches from its centre along a unit vector, seen from outside, m."""
        along = rotate(conjugate(self.pose.quaternion), axis)
        return sum(abs(a) * half for a, half in zip(along, self.half, strict=True))

    @property
    def top(self) -> float:
        """Height of the box's highest point, m."""
        return self.pose.position[2] + self.half_extent(UP)

    @property
    def bottom(self) -> float:
        """Height of the box's lowest point, m."""
        return self.pose.position[2] - self.half_extent(UP)

    def corners(self) -> list[Vector]:
        """The eight corners, m, seen from outside."""
        x, y, z = self.half
        return [self.pose.apply(corner) for corner in product((-x, x), (-y, y), (-z, z))]

    def near(self, point: Vector, distance: float) -> bool:
        """Whether a point is within ``distance`` m of the box."""
        px, py, pz = self.pose.position
        inner = rotate(
            conjugate(self.pose.quaternion), (point[0] - px, point[1] - py, point[2] - pz)
        )
        squared = 0.0
        for x, half in zip(inner, self.half, strict=True):
            beyond = abs(x) - half
            if beyond > 0.0:
                squared += beyond * beyond
        return squared < distance * distance

    def overlaps(self, other: OrientedBox) -> bool:
        """Whether two boxes share a point, by the separating axis theorem."""
        turn = conjugate(self.pose.quaternion)
        px, py, pz = self.pose.position
        qx, qy, qz = other.pose.position
        x, y, z = rotate(turn, (qx - px, qy - py, qz - pz))
        (a, b, c), (e, f, g) = self.half, other.half
        (
            (r00, r01, r02),
            (r10, r11, r12),
            (r20, r21, r22),
        ) = rotation_matrix(multiply(turn, other.pose.quaternion))
        # Upwards first: most of what could overlap stands above the other.
        if abs(z) > c + abs(r20) * e + abs(r21) * f + abs(r22) * g:
            return False
        if abs(x) > a + abs(r00) * e + abs(r01) * f + abs(r02) * g:
            return False
        if abs(y) > b + abs(r10) * e + abs(r11) * f + abs(r12) * g:
            return False
        columns = ((r00, r10, r20), (r01, r11, r21), (r02, r12, r22))
        for (u, v, w), half in zip(columns, other.half, strict=True):
            if abs(x * u + y * v + z * w) > half + a * abs(u) + b * abs(v) + c * abs(w):
                return False
        return not _edges_separate(self.half, other.half, (x, y, z), columns)


def _edges_separate(
    a: Vector, b: Vector, offset: Vector, columns: tuple[Vector, Vector, Vector]
) -> bool:
    """Whether a plane along one edge of each box separates them; all in the first one's frame."""
    x, y, z = offset
    for u, v, w in columns:
        for ax, ay, az in ((0.0, -w, v), (w, 0.0, -u), (-v, u, 0.0)):
            if ax * ax + ay * ay + az * az < PARALLEL:
                continue
            reach = a[0] * abs(ax) + a[1] * abs(ay) + a[2] * abs(az)
            for (p, q, r), half in zip(columns, b, strict=True):
                reach += half * abs(ax * p + ay * q + az * r)
            if abs(ax * x + ay * y + az * z) > reach:
                return True
    return False
