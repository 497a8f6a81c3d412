# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The controllers of a Franka arm: action servers over :class:`FrankaArm`.

A fault of the robot aborts the goal under way. Its code, one of ``slap_msgs/ErrorCode``, is the
trajectory's ``error_code``: control_msgs' own codes are 0 or below. Until somebody recovers from
the fault, every goal is refused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from ensemble.futures import wait_until
from ensemble.robot_parameters import FrankaDriverParameters, arm_joints
from robot_bridge.action_servers import arm_server, gripper_server
from robot_bridge.franka.objects import ModelledObjects
from robot_bridge.goals import is_finite, points_of, trajectory_points
from slap_ros.errors import InvalidCommandError, SlapError
from slap_ros.robot.finger_tracking import REACHED
from slap_ros.robot.franka.arm import FrankaArm, MotionResult
from slap_ros.robot.joint_trajectory import require_followable
from slap_ros.robot.trajectory_tracking import TrajectoryCode


class FrankaArmController:
    """The arm's controller: one trajectory at a time, through its points without a stop."""

    def __init__(
        self, node: Node, arm: FrankaArm, settings: FrankaDriverParameters, counts: Counter[str]
    ) -> None:
        """Open the action server.

        Args:
            node: Node that has the server.
            arm: What it moves.
            settings: Parameters of the driver.
            counts: Where goals are counted by outcome.
        """
        self._node, self._arm, self._settings, self._counts = node, arm, settings, counts
        self._joints = arm_joints(settings.arm)
        self.busy = False  # whether a goal is under way
        self.moved_s = 0.0  # by motions to their end, on the robot's clock
        self._server = arm_server(node, settings, self._move, self._on_goal)

    def destroy(self) -> None:
        """Destroy the action server."""
        self._server.destroy()

    def _on_goal(self, goal: FollowJointTrajectory.Goal) -> GoalResponse:
        try:
            self._arm.require_ready()
            require_followable(
                goal.trajectory.joint_names, self._joints, trajectory_points(goal.trajectory)
            )
            self._arm.require_possible(points_of(goal.trajectory, self._joints))
        except SlapError as error:
            self._counts["refused"] += 1
            self._node.get_logger().warning(f"refused: {error}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _move(self, handle: ServerGoalHandle) -> FollowJointTrajectory.Result:
        points = points_of(handle.request.trajectory, self._joints)
        self.busy = True
        try:
            moved = self._arm.follow(points)
            await ended(self._node, handle, moved, self._arm.hold)
        except SlapError as error:  # a fault since the goal was accepted
            moved = MotionResult(error=error)
        finally:
            self.busy = False
        return self._result(handle, moved, points[-1].positions)

    def _result(
        self, handle: ServerGoalHandle, moved: MotionResult, target: tuple[float, ...]
    ) -> FollowJointTrajectory.Result:
        off = max(abs(a - b) for a, b in zip(self._arm.reading.joints, target, strict=True))
        if moved.error is not None:
            self._counts["aborted"] += 1
            handle.abort()
            return FollowJointTrajectory.Result(
                error_code=int(moved.error.code), error_string=str(moved.error)
            )
        if handle.is_cancel_requested:
            self._counts["canceled"] += 1
            handle.canceled()
            return FollowJointTrajectory.Result()
        if off > self._settings.goal_tolerance:
            self._counts["aborted"] += 1
            handle.abort()
            return FollowJointTrajectory.Result(
                error_code=int(TrajectoryCode.GOAL_TOLERANCE_VIOLATED),
                error_string=f"a joint stands {off:.3f} rad off the goal",
            )
        self._counts["motions"] += 1
        self.moved_s += moved.ended_s - moved.began_s
        handle.succeed()
        return FollowJointTrajectory.Result()


class FrankaGripperController:
    """The gripper's controller: one motion of the fingers at a time."""

    def __init__(
        self,
        node: Node,
        arm: FrankaArm,
        objects: ModelledObjects | None,
        settings: FrankaDriverParameters,
        counts: Counter[str],
    ) -> None:
        """Open the action server.

        Args:
            node: Node that has the server.
            arm: The arm with its gripper.
            objects: What stops the fingers of a simulated arm; None where that is real.
            settings: Parameters of the driver.
            counts: Where goals are counted by outcome.
        """
        self._node, self._arm, self._objects = node, arm, objects
        self._scale, self._counts = settings.gripper_scale, counts
        self._server = gripper_server(node, settings, self._grip, self._on_goal)

    def destroy(self) -> None:
        """Destroy the action server."""
        self._server.destroy()

    def _on_goal(self, goal: GripperCommand.Goal) -> GoalResponse:
        try:
            self._arm.require_ready()
            if not is_finite(goal):
                raise InvalidCommandError("a goal of the fingers is not finite")
        except SlapError as error:
            self._node.get_logger().warning(f"refused: {error}")
            self._counts["refused"] += 1
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _grip(self, handle: ServerGoalHandle) -> GripperCommand.Result:
        command = handle.request.command
        goal = command.position / self._scale
        try:
            gap = goal if self._objects is None else self._objects.grip(goal)
            gripped = self._arm.grip(gap, command.max_effort)
            await ended(self._node, handle, gripped, lambda: None)
        except SlapError as error:
            gripped = MotionResult(error=error)
        return self._result(handle, gripped, goal)

    def _result(
        self, handle: ServerGoalHandle, gripped: MotionResult, goal: float
    ) -> GripperCommand.Result:
        gap = self._arm.reading.gap
        if gripped.error is not None:
            self._node.get_logger().error(f"{gripped.error.code.name}: {gripped.error}")
            self._counts["aborted"] += 1
            handle.abort()
            return GripperCommand.Result(position=gap * self._scale)
        self._counts["grips"] += 1
        handle.succeed()
        reached = abs(gap - goal) <= REACHED
        return GripperCommand.Result(
            position=gap * self._scale, stalled=not reached, reached_goal=reached
        )


async def ended(
    node: Node, handle: ServerGoalHandle, outcome: MotionResult, cancel: Callable[[], None]
) -> None:
    """Wait for the end of a motion.

    Args:
        node: Node whose timer looks at the motion.
        handle: Goal that the motion belongs to.
        outcome: Result of the motion, when it has ended.
        cancel: Called once where the goal is to be canceled.
    """
    canceled = False

    def over() -> bool:
        nonlocal canceled
        if handle.is_cancel_requested and not canceled:
            canceled = True
            cancel()
        return outcome.done.is_set()

    await wait_until(node, over)
