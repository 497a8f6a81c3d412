# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of bodies at rest, corrected to where physics would have them.

A block measured 2 mm above the table neither floats nor is sunk in; left as measured it would fall
in the planner's model, and predicates of touching would flicker. What a camera saw at a wrong
height was seen at a wrong distance: it is put right along the line of sight, and so sideways too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.worlds.joint_space.scene import Body
from slap_ros.worlds.settling import FLOATING, levelled

SEEN_FLOATING = 0.024  # m, the same as FLOATING for what a camera sees; less than half a block
STEEP = 0.3  # sine of the least angle of a line of sight with the table that says where things are


def resting_poses(
    measured: Mapping[int, Pose],
    bodies: Sequence[Body],
    fixed: Sequence[OrientedBox],
    eyes: Mapping[int, Vector] | None = None,
) -> dict[int, Pose]:
    """Poses of bodies at rest, each flat on what supports it; as measured where that is unclear.

    Args:
        measured: Pose of each body at rest in the base's frame, by index among the bodies.
        bodies: The free bodies of the scene.
        fixed: The boxes of the solid bodies that do not move, base's frame.
        eyes: Where the camera is that saw a body, base's frame, for those that a camera saw.

    Returns:
        A pose for each measured one, by the same index.
    """
    below = list(fixed)
    poses = {}
    for i in sorted(measured, key=lambda i: measured[i].position[2]):
        pose = levelled(measured[i])
        if pose is not None:
            pose = _put_down(pose, bodies[i], below, (eyes or {}).get(i))
        poses[i] = measured[i] if pose is None else pose
        below.append(bodies[i].at(poses[i]))
    return poses


def _put_down(
    pose: Pose, body: Body, below: Sequence[OrientedBox], eye: Vector | None
) -> Pose | None:
    """The pose on the highest top near the body's bottom, if there is one."""
    box = body.at(pose)  # whose middle need not be the body's origin
    bottom = box.bottom
    tops = [other.top for other in below if _under(box, other)]
    floating = FLOATING if eye is None else SEEN_FLOATING
    near = [top for top in tops if abs(bottom - top) <= floating]
    if not near:
        return None
    return Pose(_raised(pose.position, max(near) - bottom, eye), pose.quaternion)


def _raised(point: Vector, rise: float, eye: Vector | None) -> Vector:
    """A point raised by some metres: along the line of sight of a camera that looks down on it."""
    x, y, z = point
    if eye is not None:
        sight = [a - b for a, b in zip(point, eye, strict=True)]
        if abs(sight[2]) >= STEEP * math.hypot(*sight):
            part = rise / sight[2]
            return (x + part * sight[0], y + part * sight[1], z + rise)
    return (x, y, z + rise)


def _under(box: OrientedBox, other: OrientedBox) -> bool:
    """Whether a box's middle is over another one, or beside it by less than it is wide."""
    middle_x, middle_y, _ = box.pose.position
    x, y, z = other.pose.inverse().apply((middle_x, middle_y, other.pose.position[2]))
    reach = min(box.half)
    return all(abs(a) <= half + reach for a, half in zip((x, y, z), other.half, strict=True))
