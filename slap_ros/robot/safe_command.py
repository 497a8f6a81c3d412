# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A command of the domain, as a robot carries it out."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.relational import State
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.limits import JointMotion


@dataclass(frozen=True)
class SafeCommand:
    """One command, within the arm's limits: first the gripper acts, then the arm moves.

    Args:
        gripper: What the gripper does first.
        motion: Motion of the arm.
        after: State of the domain's own world, which took the same step.
    """

    gripper: GripperAction
    motion: JointMotion
    after: State
