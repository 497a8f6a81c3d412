# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an action makes of the hand's target and its gripper, whoever moves the hand.

The contact world pulls the hand there by a force. A robot pulls the arm's joints there, see
``robot.mujoco.contact_loop``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.core import Action
from slap_ros.geometry.pose import Pose, Vector, from_rotation_vector, multiply
from slap_ros.worlds.contact.arm import Joints, arm_joints, share_in_time
from slap_ros.worlds.contact.hand import LEASH, YAW_LEASH, HandState, rotation_between

ACTING = 0.5  # 1, beyond which the gripper is told something new


@dataclass(frozen=True)
class HandCommand:
    """What the hand was told last, which is a part of its state that nothing measures.

    Args:
        target: Position that the hand is pulled to, m.
        target_yaw: Yaw that the hand is pulled to, rad; not wrapped.
        closing: Whether the gripper was told to close.
    """

    target: Vector
    target_yaw: float
    closing: bool

    @classmethod
    def of(cls, hand: HandState) -> HandCommand:
        """The command in a hand's state."""
        return cls(hand.target, hand.target_yaw, hand.closing)

    @classmethod
    def to_stay(cls, pose: Pose, closing: bool) -> HandCommand:
        """The command of a hand that stands where it was told to be."""
        x, y, _, _ = pose.quaternion
        return cls(pose.position, 2.0 * math.atan2(y, x), closing)


@dataclass(frozen=True)
class CommandedHand:
    """The hand with its target moved and its gripper told, before anything has moved.

    Args:
        hand: Hand where it is, with its new target.
        share: Share of the way to the target that the arm can well go in a control period.
    """

    hand: HandState
    share: float

    def pull(self, part: float = 1.0) -> Pose:
        """The pose that the hand is pulled to in the control period.

        Args:
            part: Part of the way that the arm can go.
        """
        return _part_way(self.hand.pose, self.hand.target_pose, part * self.share)


def commanded(hand: HandState, joints: Joints, action: Action) -> CommandedHand:
    """Move the hand's target, no further than its leash, and tell the gripper.

    A target that the arm cannot reach is refused: the old one stays.

    Args:
        hand: Hand at the beginning of a control period.
        joints: Joint positions of the arm then, rad.
        action: Action of the contact world's space.

    Returns:
        The hand with its new target, and how far the arm can go there.
    """
    told = _told(hand, action.tolist())
    goal = arm_joints(told.target_pose)
    if goal is None:
        told = hand._replace(closing=told.closing)
        goal = arm_joints(told.target_pose)
    return CommandedHand(told, 0.0 if goal is None else share_in_time(joints, goal))


def _told(hand: HandState, action: list[float]) -> HandState:
    *shift, turn, gripper = action
    x, y, z = (
        min(max(t + d, p - LEASH), p + LEASH)
        for t, d, p in zip(hand.target, shift, hand.pose.position, strict=True)
    )
    yaw = min(max(hand.target_yaw + turn, hand.yaw - YAW_LEASH), hand.yaw + YAW_LEASH)
    closing = gripper > ACTING or (hand.closing and gripper >= -ACTING)
    return hand._replace(target=(x, y, z), target_yaw=yaw, closing=closing)


def _part_way(start: Pose, goal: Pose, share: float) -> Pose:
    """The pose after a share, up to 1, of the way."""
    if share == 1.0:
        return goal
    x, y, z = (a + share * (b - a) for a, b in zip(start.position, goal.position, strict=True))
    u, v, w = (share * r for r in rotation_between(start, goal))
    return Pose((x, y, z), multiply(from_rotation_vector((u, v, w)), start.quaternion))
