# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands of a closed loop that the arm executes in one motion, without a stop between them.

The arm does not begin before it has them all, so it is never ahead of what was commanded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from slap_ros.robot.blending import STANDS, MotionLimits, blend
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import JointMotion
from slap_ros.robot.safe_command import SafeCommand


@dataclass
class Horizon:
    """Commands that wait to be executed together.

    Args:
        longest: Largest number of commands.
        limits: Limits that a motion through several steps keeps to.
        least_s: Least duration of a step, s.
    """

    longest: int
    limits: MotionLimits
    least_s: float
    commands: list[SafeCommand] = field(default_factory=list)

    def add(self, command: SafeCommand) -> None:
        """Have a command executed after the others. The fingers can act before the first only."""
        assert not self.commands or command.gripper is GripperAction.KEEP
        self.commands.append(command)

    @property
    def has_room(self) -> bool:
        """Whether one more command can wait."""
        return len(self.commands) < self.longest

    def take(self) -> tuple[GripperAction, tuple[TrajectoryPoint, ...]]:
        """What waits, to be executed now: what the fingers do first, then points of a motion."""
        taken, self.commands = self.commands, []
        motions = [command.motion for command in taken]
        return taken[0].gripper, motion_through(motions, self.limits, self.least_s)


def motion_through(
    motions: Sequence[JointMotion], limits: MotionLimits, least_s: float
) -> tuple[TrajectoryPoint, ...]:
    """The points of one motion through the targets of some; a single one is from rest to rest.

    Args:
        motions: Safe motions, each of which begins where the one before ends.
        limits: Limits that a motion through several targets keeps to.
        least_s: Least duration of a step, s.
    """
    moving = [motion for motion in motions if _moves(motion)] or motions[-1:]
    if len(moving) > 1:
        return blend([moving[0].start, *(m.target for m in moving)], limits, least_s).points
    still = (0.0,) * len(moving[0].target)
    return (TrajectoryPoint(moving[0].duration_s, moving[0].target, still, still),)


def _moves(motion: JointMotion) -> bool:
    return max(abs(a - b) for a, b in zip(motion.start, motion.target, strict=True)) > STANDS
