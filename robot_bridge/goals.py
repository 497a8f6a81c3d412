# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Goals of a robot's controllers, as their servers take them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from control_msgs.action import GripperCommand
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory

from slap_ros.robot.joint_trajectory import TrajectoryPoint


class GoalUnderWay:
    """The goal that a controller carries out, until something ends it."""

    def __init__(self) -> None:
        self._handle: ServerGoalHandle | None = None
        self._ended: Future | None = None

    @property
    def is_cancel_requested(self) -> bool:
        """Whether there is one, and its end is asked for."""
        return self._handle is not None and self._handle.is_cancel_requested

    def begin(self, handle: ServerGoalHandle) -> Future:
        """A goal is under way from now on; the future that is done at its end, with the outcome."""
        self._handle, self._ended = handle, Future()
        return self._ended

    def end(self, outcome: object) -> None:
        """End the goal that is under way, if there is one."""
        if self._ended is not None and not self._ended.done():
            self._ended.set_result(outcome)
        self._ended = self._handle = None


def trajectory_points(trajectory: JointTrajectory) -> list[TrajectoryPoint]:
    """The points of a trajectory, in the order of its own joints."""
    return [
        TrajectoryPoint(
            point.time_from_start.sec + point.time_from_start.nanosec * 1e-9,
            tuple(point.positions),
            tuple(point.velocities),
            tuple(point.accelerations),
        )
        for point in trajectory.points
    ]


def points_of(trajectory: JointTrajectory, joints: Sequence[str]) -> list[TrajectoryPoint]:
    """The points of a trajectory, in the order of the controller's joints."""
    order = [list(trajectory.joint_names).index(name) for name in joints]
    return [in_order(point, order) for point in trajectory_points(trajectory)]


def is_finite(goal: GripperCommand.Goal) -> bool:
    """Whether a goal of the fingers is one at all."""
    return math.isfinite(goal.command.position) and math.isfinite(goal.command.max_effort)


def in_order(point: TrajectoryPoint, order: Sequence[int]) -> TrajectoryPoint:
    """The point with its joints in the controller's order."""
    return TrajectoryPoint(
        point.time_s,
        tuple(point.positions[i] for i in order),
        tuple(point.velocities[i] for i in order) if point.velocities else (),
        tuple(point.accelerations[i] for i in order) if point.accelerations else (),
    )
