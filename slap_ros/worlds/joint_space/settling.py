# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of bodies at rest, corrected to where physics would have them.

A block measured 2 mm above the table neither floats nor is sunk in; left as measured it would fall
in the planner's model, and predicates of touching would flicker.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.joint_space.scene import Body
from slap_ros.worlds.settling import FLOATING, levelled


def resting_poses(
    measured: Mapping[int, Pose], bodies: Sequence[Body], fixed: Sequence[OrientedBox]
) -> dict[int, Pose]:
    """Poses of bodies at rest, each flat on what supports it; as measured where that is unclear.

    Args:
        measured: Pose of each body at rest in the base's frame, by index among the bodies.
        bodies: The free bodies of the scene.
        fixed: The boxes of the solid bodies that do not move, base's frame.

    Returns:
        A pose for each measured one, by the same index.
    """
    below = list(fixed)
    poses = {}
    for i in sorted(measured, key=lambda i: measured[i].position[2]):
        pose = levelled(measured[i])
        if pose is not None:
            pose = _put_down(pose, bodies[i], below)
        poses[i] = measured[i] if pose is None else pose
        below.append(bodies[i].at(poses[i]))
    return poses


def _put_down(pose: Pose, body: Body, below: Sequence[OrientedBox]) -> Pose | None:
    """The pose on the highest top near the body's bottom, if there is one."""
    box = body.at(pose)  # whose middle need not be the body's origin
    bottom = box.bottom
    tops = [other.top for other in below if _under(box, other)]
    near = [top for top in tops if abs(bottom - top) <= FLOATING]
    if not near:
        return None
    x, y, z = pose.position
    return Pose((x, y, z + max(near) - bottom), pose.quaternion)


def _under(box: OrientedBox, other: OrientedBox) -> bool:
    """Whether a box's middle is over another one, or beside it by less than it is wide."""
    middle_x, middle_y, _ = box.pose.position
    x, y, z = other.pose.inverse().apply((middle_x, middle_y, other.pose.position[2]))
    reach = min(box.half)
    return all(abs(a) <= half + reach for a, half in zip((x, y, z), other.half, strict=True))
