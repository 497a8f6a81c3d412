# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's controllers: one short goal at a time, each ending with the robot at rest."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic
from typing import Any

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory, GripperCommand
from control_msgs.msg import GripperCommand as GripperGoal
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ensemble.futures import wait_for_first
from slap_ros.errors import (
    ControllerAbortedError,
    ControllerRejectedError,
    ControllerTimeoutError,
    ErrorCode,
    error_from,
)
from slap_ros.robot.joint_trajectory import TrajectoryPoint

TRAJECTORY_CODES = {  # control_msgs' names of what a trajectory's result says
    getattr(FollowJointTrajectory.Result, name): name
    for name in (
        "SUCCESSFUL",
        "INVALID_GOAL",
        "INVALID_JOINTS",
        "OLD_HEADER_TIMESTAMP",
        "PATH_TOLERANCE_VIOLATED",
        "GOAL_TOLERANCE_VIOLATED",
    )
}
OWN_CODES = frozenset(  # of ours, which our driver gives a trajectory's result: above control_msgs'
    int(code) for code in ErrorCode if code > ErrorCode.UNKNOWN
)
STATUSES = {  # of a goal that did not succeed
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "gave up",
}


class Controllers:
    """Clients of the arm's and the gripper's controller."""

    def __init__(self, node: Node, arm: str, gripper: str, joints: list[str], grace_s: float):
        """Make the clients.

        Args:
            node: Node that sends the goals.
            arm: Name of the arm's FollowJointTrajectory action.
            gripper: Name of the gripper's GripperCommand action.
            joints: Names of the arm's joints.
            grace_s: How much longer than asked a motion may take.
        """
        self._node, self._joints, self._grace_s = node, joints, grace_s
        self._arm = ActionClient(node, FollowJointTrajectory, arm)
        self._gripper = ActionClient(node, GripperCommand, gripper)
        self._names = {self._arm: arm, self._gripper: gripper}
        self._sent: Future | None = None  # of the goal under way: its handle, once it is accepted

    def destroy(self) -> None:
        """Destroy the clients."""
        self._arm.destroy()
        self._gripper.destroy()

    @property
    def ready(self) -> bool:
        """Whether both controllers are there."""
        return not self.missing

    @property
    def missing(self) -> list[str]:
        """Names of the actions that no controller offers."""
        return [name for client, name in self._names.items() if not client.server_is_ready()]

    async def follow(self, points: Sequence[TrajectoryPoint]) -> None:
        """Move the arm through points; their limits were checked when they were made.

        Args:
            points: Points of a trajectory that ends at rest.

        Raises:
            ControllerRejectedError: The goal was not accepted.
            ControllerAbortedError: It was given up, or canceled.
            ControllerTimeoutError: No controller, or no answer in time; the goal is canceled.
            SlapError: The cause that a driver of ours gives.
        """
        goal = FollowJointTrajectory.Goal(trajectory=trajectory(points, self._joints))
        outcome = await self._run(self._arm, goal, points[-1].time_s + self._grace_s)
        if outcome.status != GoalStatus.STATUS_SUCCEEDED:
            code, reason = outcome.result.error_code, outcome.result.error_string
            if code in OWN_CODES:
                raise error_from(code, f"{self._names[self._arm]}: {reason}")
            raise ControllerAbortedError(
                f"{self._names[self._arm]} {_ending(outcome.status)} a motion: "
                f"{TRAJECTORY_CODES.get(code, f'unknown code {code}')}, "
                f"{reason or 'no reason given'}"
            )

    async def move_gripper(self, position: float, effort: float, limit_s: float) -> bool:
        """Move the fingers, or close them around something.

        A controller may succeed with fingers that stall at something, or abort: both are usual.

        Args:
            position: Position as the controller expects it: for Franka's, half the gap, m.
            effort: Largest force, N.
            limit_s: How long it may take.

        Returns:
            Whether the goal was reached. If not, the controller aborted because the fingers
            stalled, and only their positions say whether they hold something.

        Raises:
            ControllerRejectedError: The goal was not accepted.
            ControllerAbortedError: It was canceled, or given up while the fingers could move.
            ControllerTimeoutError: No controller, or no answer in time; the goal is canceled.
        """
        command = GripperGoal(position=position, max_effort=effort)
        outcome = await self._run(self._gripper, GripperCommand.Goal(command=command), limit_s)
        if outcome.status == GoalStatus.STATUS_SUCCEEDED:
            return True
        if outcome.status == GoalStatus.STATUS_ABORTED and outcome.result.stalled:
            return False
        raise ControllerAbortedError(
            f"{self._names[self._gripper]} {_ending(outcome.status)} a goal"
        )

    def hold(self) -> None:
        """Have the goal under way canceled, if there is one: controllers then hold.

        One that is not accepted yet is canceled when it is.
        """
        if self._sent is None:
            return
        if self._sent.done():
            _cancel(self._sent)
        else:
            self._sent.add_done_callback(_cancel)
        self._sent = None

    async def _run(self, client: ActionClient, goal: object, limit_s: float) -> Any:
        name = self._names[client]
        if not client.server_is_ready():
            raise ControllerTimeoutError(f"{name} is not there: is the controller running?")
        end = monotonic() + limit_s
        self._sent = sent = client.send_goal_async(goal)
        if not await wait_for_first(self._node, sent, lambda: monotonic() > end):
            self.hold()
            raise ControllerTimeoutError(f"{name} did not answer within {limit_s:.2f} s")
        handle = sent.result()
        if not handle.accepted:
            raise ControllerRejectedError(f"{name} rejected a goal")
        ended = handle.get_result_async()
        if not await wait_for_first(self._node, ended, lambda: monotonic() > end):
            self.hold()
            raise ControllerTimeoutError(f"{name} was not done within {limit_s:.2f} s")
        self._sent = None
        return ended.result()


def _ending(status: int) -> str:
    """How a goal ended that did not succeed, as the middle of a sentence."""
    return STATUSES.get(status, f"ended with status {status}")


def _cancel(sent: Future) -> None:
    if sent.result().accepted:
        sent.result().cancel_goal_async()


def trajectory(points: Sequence[TrajectoryPoint], joints: list[str]) -> JointTrajectory:
    """From wherever the arm stands through points: quintics to a controller."""
    return JointTrajectory(
        joint_names=joints,
        points=[
            JointTrajectoryPoint(
                positions=list(point.positions),
                velocities=list(point.velocities),
                accelerations=list(point.accelerations),
                time_from_start=_duration(point.time_s),
            )
            for point in points
        ],
    )


def _duration(time_s: float) -> Duration:
    whole = int(time_s)
    return Duration(sec=whole, nanosec=int((time_s - whole) * 1e9))
