# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the hand holds, as it is seen: fingers hold by friction, and what pushes others slips.

Where nothing sees it, it counts as held where it was before.
"""

from __future__ import annotations

import math
from dataclasses import replace

from slap_ros.geometry.pose import IDENTITY, Pose, Vector, conjugate, normalised, rotate
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.line_of_sight import across
from slap_ros.robot.state_assembly import Grasp, possible_joints
from slap_ros.robot.tracking import PoseEstimate
from slap_ros.worlds.joint_space.scene import Body
from slap_ros.worlds.panda import hand_pose

GRASPED = 0.5  # of the object's width; with less there is nothing between the fingers
FOLLOWS = 0.03  # m, by which what is held may slip in a step; what is further away was lost


def expected_pose(grasp: Grasp, reading: JointReading) -> Pose:
    """Where the hand has what it holds, in the base's frame, if it has not slipped."""
    return hand_pose(possible_joints(reading.joints)).compose(grasp.pose)


def narrowest_width(body: Body, grasp: Pose) -> float:
    """How wide a body is between the fingers, m, where it is narrowest.

    Fingers close until they meet it, wherever in the hand it is: its middle may be beside theirs,
    and a tool has a handle that is narrower than the rest of it.

    Args:
        body: What the hand closes around.
        grasp: Pose of the body in the hand's frame.
    """
    along = rotate(conjugate(grasp.quaternion), (0.0, 1.0, 0.0))
    widths = []
    for core in body.cores(IDENTITY):
        seen = rotate(conjugate(core.pose.quaternion), along)
        widths.append(2.0 * sum(abs(a) * half for a, half in zip(seen, core.half, strict=True)))
    return min(widths)


def is_lost(grasp: Grasp, reading: JointReading, seen: PoseEstimate | None) -> bool:
    """Whether what was held does not follow the hand, or the fingers are shut.

    How far away a camera sees it says nothing of that: fingers cover its tags.

    Args:
        grasp: Grasp as it was measured last.
        reading: Joints and fingers, measured now.
        seen: Pose of the held object, if anything sees it.
    """
    strayed = seen is not None and math.hypot(*_offset(grasp, reading, seen)) > FOLLOWS
    shut = reading.gap is not None and reading.gap < GRASPED * grasp.width
    return strayed or shut


def grasp_as_seen(grasp: Grasp, reading: JointReading, seen: PoseEstimate | None) -> Grasp:
    """The grasp with its pose measured again; the same to the bit where nothing slipped.

    How far away a camera sees it says nothing of a slip.

    Args:
        grasp: Grasp as it was measured last.
        reading: Joints, measured now.
        seen: Pose of the held object: the expected one where detections agree with it.
    """
    if seen is None or not seen.at_rest or seen.pose == expected_pose(grasp, reading):
        return grasp
    expected, offset = expected_pose(grasp, reading).position, _offset(grasp, reading, seen)
    x, y, z = (a + d for a, d in zip(expected, offset, strict=True))
    in_base = Pose((x, y, z), seen.pose.quaternion)
    pose = hand_pose(possible_joints(reading.joints)).inverse().compose(in_base)
    return replace(grasp, pose=Pose(pose.position, normalised(pose.quaternion)))


def _offset(grasp: Grasp, reading: JointReading, seen: PoseEstimate) -> Vector:
    """From where the hand has what it holds to where it is seen, m."""
    expected, found = expected_pose(grasp, reading).position, seen.pose.position
    return across([b - a for a, b in zip(expected, found, strict=True)], found, seen.eye)
