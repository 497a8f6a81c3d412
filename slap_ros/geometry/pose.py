# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid poses in plain floats: for a handful of bodies, numpy would cost more than it gives."""

from __future__ import annotations

import math
from typing import NamedTuple

Vector = tuple[float, float, float]  # x y z
Quaternion = tuple[float, float, float, float]  # x y z w, of length 1

ORIGIN: Vector = (0.0, 0.0, 0.0)
NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation that turns by ``b`` first, then by ``a``."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """The rotation back: the inverse of a quaternion of length 1."""
    return (-q[0], -q[1], -q[2], q[3])


def from_rotation_vector(v: Vector) -> Quaternion:
    """The rotation about the axis ``v`` by its length in rad."""
    angle = math.hypot(*v)
    if angle == 0.0:
        return NO_ROTATION
    part = math.sin(0.5 * angle) / angle
    return (part * v[0], part * v[1], part * v[2], math.cos(0.5 * angle))


def from_yaw(yaw: float) -> Quaternion:
    """The rotation about z by an angle in rad."""
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def normalised(q: Quaternion) -> Quaternion:
    """The quaternion divided by its length."""
    length = math.hypot(*q)
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


def rotation_matrix(q: Quaternion) -> tuple[Vector, Vector, Vector]:
    """The rotation matrix of a quaternion, row by row."""
    x, y, z, w = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def dot(a: Vector, b: Vector) -> float:
    """The inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """The vector turned by the quaternion."""
    x, y, z, w = q
    a, b, c = v
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (
        a + w * tx + y * tz - z * ty,
        b + w * ty + z * tx - x * tz,
        c + w * tz + x * ty - y * tx,
    )


class Pose(NamedTuple):
    """Where a frame is, seen from another: position in m and orientation."""

    position: Vector = ORIGIN
    quaternion: Quaternion = NO_ROTATION

    def compose(self, inner: Pose) -> Pose:
        """The pose, seen from outside, of a frame that is at ``inner`` seen from this one."""
        return Pose(self.apply(inner.position), multiply(self.quaternion, inner.quaternion))

    def inverse(self) -> Pose:
        """The outer frame seen from this one."""
        back = conjugate(self.quaternion)
        x, y, z = rotate(back, self.position)
        return Pose((-x, -y, -z), back)

    def apply(self, point: Vector) -> Vector:
        """A point of this frame, seen from outside."""
        x, y, z = rotate(self.quaternion, point)
        px, py, pz = self.position
        return (px + x, py + y, pz + z)

    def angle_to(self, other: Pose) -> float:
        """The angle in rad, 0 to pi, between two orientations."""
        x, y, z, w = multiply(other.quaternion, conjugate(self.quaternion))
        return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


IDENTITY = Pose()
