# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's controllers, told something else while they carry out what they were told before."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from control_msgs.action import GripperCommand
from control_msgs.msg import GripperCommand as GripperGoal
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory

from ensemble.interfaces import VOLATILE
from robot_bridge.controllers import trajectory
from slap_ros.errors import ControllerRejectedError, SlapError
from slap_ros.robot.joint_trajectory import TrajectoryPoint


class ServoControllers:
    """The topic of the arm's joint_trajectory_controller, and the gripper's action.

    A trajectory replaces the one under way, and a gripper's goal the one before; nothing waits for
    either.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        gripper: str,
        joints: list[str],
        on_failure: Callable[[SlapError], None],
    ) -> None:
        """Make publisher and client.

        Args:
            node: Node that sends.
            topic: Name of the arm's topic.
            gripper: Name of the gripper's GripperCommand action.
            joints: Names of the arm's joints.
            on_failure: Called where the gripper rejects a goal.
        """
        self._topic, self._gripper_name, self._joints = topic, gripper, joints
        self._on_failure = on_failure
        self._arm = node.create_publisher(JointTrajectory, topic, VOLATILE)
        self._gripper = ActionClient(node, GripperCommand, gripper)

    def destroy(self) -> None:
        """Destroy the client; the node destroys the publisher."""
        self._gripper.destroy()

    @property
    def missing(self) -> list[str]:
        """Names of the topic and the action that no controller has."""
        there = {
            self._topic: self._arm.get_subscription_count() > 0,
            self._gripper_name: self._gripper.server_is_ready(),
        }
        return [name for name, found in there.items() if not found]

    def follow(self, points: Sequence[TrajectoryPoint]) -> None:
        """Have the arm move through points, in place of what it was told before."""
        self._arm.publish(trajectory(points, self._joints))

    def move_gripper(self, position: float, effort: float) -> None:
        """Have the fingers move.

        Args:
            position: Position as the controller expects it: for Franka's, half the gap, m.
            effort: Largest force, N.
        """
        goal = GripperCommand.Goal(command=GripperGoal(position=position, max_effort=effort))
        self._gripper.send_goal_async(goal).add_done_callback(self._on_answer)

    def _on_answer(self, sent: Future) -> None:
        if not sent.result().accepted:
            self._on_failure(ControllerRejectedError(f"{self._gripper_name} rejected a goal"))
