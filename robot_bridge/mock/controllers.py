# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The mock robot's controllers: action servers that move the plant."""

from __future__ import annotations

import math
from collections import Counter

from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from ensemble.robot_parameters import MockRobotParameters, arm_joints
from robot_bridge.action_servers import arm_server, gripper_server
from robot_bridge.goals import is_finite, trajectory_points
from robot_bridge.mock.plant import Plant
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.simulated.waiting import pause
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, JOINTS

LONGEST_PAUSE = 1.0  # s


class MockControllers:
    """A joint trajectory controller and a gripper controller.

    While ``busy``, a goal is under way, which makes the plant's time pass.
    """

    def __init__(
        self,
        node: Node,
        plant: Plant,
        noise: NoiseModel,
        settings: MockRobotParameters,
        period_s: float,
        counts: Counter[str],
    ) -> None:
        """Open both action servers.

        Args:
            node: Node that has the action servers.
            plant: What they move.
            noise: Noise model that draws how late each action begins.
            settings: Parameters of the mock robot.
            period_s: How long a control period lasts here, s.
            counts: Where goals are counted by outcome.
        """
        self.busy = False
        self._node, self._plant, self._noise = node, plant, noise
        self._settings, self._period_s, self._counts = settings, period_s, counts
        self._joints = arm_joints(settings.arm)
        self._arm = arm_server(node, settings, self._move, self._on_motion)
        self._gripper = gripper_server(node, settings, self._grip, self._on_grip)

    def destroy(self) -> None:
        """Destroy the action servers."""
        self._arm.destroy()
        self._gripper.destroy()

    def _fails(self, fault: str) -> bool:
        """Whether a motion is to fail in this way now."""
        due = self._counts["motions"] >= self._settings.fault_after
        return self._settings.fault == fault and due

    def _on_motion(self, goal: FollowJointTrajectory.Goal) -> GoalResponse:
        known = list(goal.trajectory.joint_names) == self._joints
        if self.busy or self._fails("reject") or not known or not _possible(goal):
            self._counts["refused"] += 1
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _on_grip(self, goal: GripperCommand.Goal) -> GoalResponse:
        if self.busy or not is_finite(goal):
            self._counts["refused"] += 1
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _move(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        self.busy = True
        try:
            await pause(self._node, self._noise.delay_s())
            if self._fails("abort"):
                return self._abort(goal)
            if self._fails("stand"):
                return self._arrive(goal)
            return await self._follow(goal)
        finally:
            self.busy = False

    def _abort(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        self._counts["aborted"] += 1
        goal.abort()
        return FollowJointTrajectory.Result(
            error_code=FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED,
            error_string="set up to fail",
        )

    async def _follow(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        """Go from point to point, however fast the arm may be at them."""
        began_s = 0.0
        for point in trajectory_points(goal.request.trajectory):
            if not await self._approach(goal, point, point.time_s - began_s):
                self._counts["canceled"] += 1
                goal.canceled()
                return FollowJointTrajectory.Result()
            began_s = point.time_s
        return self._arrive(goal)

    def _arrive(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        self._counts["motions"] += 1
        goal.succeed()
        return FollowJointTrajectory.Result()

    async def _approach(
        self, goal: ServerGoalHandle, point: TrajectoryPoint, lasts_s: float
    ) -> bool:
        """Go to a point; whether the arm got there before the goal was canceled."""
        ignored = self._fails("ignore")
        # A cancel is noticed within LONGEST_PAUSE.
        periods = max(
            self._plant.periods_to(point.positions),
            math.ceil(lasts_s / self._settings.pace / LONGEST_PAUSE),
        )
        done = 0
        while ignored or done < periods:
            await pause(self._node, lasts_s / periods / self._settings.pace)
            if goal.is_cancel_requested:
                return False
            if not ignored:
                self._plant.approach(point.positions)
                done += 1
        return True

    async def _grip(self, goal: ServerGoalHandle) -> GripperCommand.Result:
        self.busy = True
        try:
            await pause(self._node, self._noise.delay_s() + self._period_s)
            wanted = goal.request.command.position / self._settings.gripper_scale
            self._plant.move_fingers(shut=wanted < self._plant.gap)
        finally:
            self.busy = False
        self._counts["grips"] += 1
        goal.succeed()
        return GripperCommand.Result(
            position=self._plant.gap * self._settings.gripper_scale,
            stalled=self._plant.holding,
            reached_goal=not self._plant.holding,
        )


def _possible(goal: FollowJointTrajectory.Goal) -> bool:
    """Whether a real arm could follow a trajectory to its end."""
    if not goal.trajectory.points:
        return False
    end = goal.trajectory.points[-1]
    return (
        end.time_from_start.sec >= 0
        and len(end.positions) == JOINTS
        and all(
            low <= q <= high
            for low, q, high in zip(JOINT_LOW, end.positions, JOINT_HIGH, strict=True)
        )
    )
