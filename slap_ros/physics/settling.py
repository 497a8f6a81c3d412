# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What lies still lies on something: measured poses put where physics would have them.

A block seen 2 mm above the table neither floats nor is sunk in; left as measured it would fall in
the planner's model, and predicates of touching would flicker.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Quaternion, Vector, conjugate, multiply, rotate
from slap_ros.physics.scene import Body

LEANING = 0.15  # rad; what is tilted by more does not lie on a face
FLOATING = 0.015  # m, between a bottom and the top of what it is taken to lie on
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def resting_poses(
    measured: Mapping[int, Pose], bodies: Sequence[Body], fixed: Sequence[OrientedBox]
) -> dict[int, Pose]:
    """Poses of bodies at rest, each flat on what it lies on; left alone where that is unclear.

    Args:
        measured: By index among the bodies.
        bodies: The free ones.
        fixed: The solid ones that do not move.
    """
    below = list(fixed)
    poses = {}
    for i in sorted(measured, key=lambda i: measured[i].position[2]):
        pose = _levelled(measured[i])
        if pose is not None:
            pose = _put_down(pose, bodies[i], below)
        poses[i] = measured[i] if pose is None else pose
        below.append(bodies[i].at(poses[i]))
    return poses


def _levelled(pose: Pose) -> Pose | None:
    """With the axis that points up or down best exactly so; None where none does."""
    ups = [rotate(pose.quaternion, axis) for axis in AXES]
    x, y, z = max(ups, key=lambda up: abs(up[2]))
    angle = math.atan2(math.hypot(x, y), abs(z))
    if angle > LEANING:
        return None
    sign = math.copysign(1.0, z)
    x, y, z = sign * x, sign * y, sign * z
    # The shortest turn that takes (x, y, z) to the vertical.
    turn = _unit((y, -x, 0.0, 1.0 + z))
    return Pose(pose.position, _unit(multiply(turn, pose.quaternion)))


def _put_down(pose: Pose, body: Body, below: Sequence[OrientedBox]) -> Pose | None:
    """On the highest top near its bottom, if there is one."""
    x, y, z = pose.position
    box = body.at(pose)
    half = _height(box)
    tops = [
        other.pose.position[2] + _height(other) for other in below if _under((x, y), box, other)
    ]
    near = [top for top in tops if abs(z - half - top) <= FLOATING]
    if not near:
        return None
    return Pose((x, y, max(near) + half), pose.quaternion)


def _height(box: OrientedBox) -> float:
    """Half of it."""
    up = rotate(conjugate(box.pose.quaternion), (0.0, 0.0, 1.0))
    return sum(abs(a) * half for a, half in zip(up, box.half, strict=True))


def _under(place: tuple[float, float], box: OrientedBox, other: OrientedBox) -> bool:
    """Whether a box's middle is over another one, or beside it by less than it is wide."""
    x, y, z = other.pose.inverse().apply((*place, other.pose.position[2]))
    reach = min(box.half)
    return all(abs(a) <= half + reach for a, half in zip((x, y, z), other.half, strict=True))


def _unit(q: tuple[float, float, float, float]) -> Quaternion:
    length = math.hypot(*q)
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
