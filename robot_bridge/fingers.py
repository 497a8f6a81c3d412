# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fingers moved, and where they then stand."""

from __future__ import annotations

from typing import Protocol

from rclpy.node import Node
from rclpy.task import Future

from ensemble.waiting import first_of, seconds
from robot_bridge.controllers import Controllers
from robot_bridge.senses import Senses
from slap_ros.errors import NoJointStateError

GAP_AGE = 0.1  # s, by which told finger positions may be older than their stamp: drivers merge them


class Settings(Protocol):
    """Of the parameters of robot_bridge, those of the gripper."""

    gripper_scale: float
    gripper_effort: float
    gripper_timeout: float
    joint_timeout: float


async def move_fingers(
    node: Node, controllers: Controllers, senses: Senses, gap: float, settings: Settings
) -> float:
    """Move the fingers to ``gap`` m, or until they stall; the gap in m at which they then stand.

    Raises:
        ControllerRejectedError, ControllerAbortedError, ControllerTimeoutError: Of the gripper.
        NoJointStateError: Nobody says where they are.
    """
    await controllers.grip(
        gap * settings.gripper_scale, settings.gripper_effort, settings.gripper_timeout
    )
    done_s = seconds(node) + GAP_AGE
    late_s = done_s + settings.joint_timeout
    await first_of(
        node,
        Future(),
        lambda: senses.gap_s > done_s or seconds(node) > late_s,
    )
    if senses.gap is None or senses.gap_s <= done_s:
        raise NoJointStateError(
            f"no positions of the fingers within {settings.joint_timeout} s: are they among "
            "joint_states?"
        )
    return senses.gap
