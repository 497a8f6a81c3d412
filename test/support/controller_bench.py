# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clients of the controllers of one arm, and its joint states."""

from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState

from ensemble.interfaces import JOINT_STATES, SENSOR_DATA
from ensemble.robot_parameters import arm_joints
from support.bench import Bench


class ControllerBench(Bench):
    """Clients of the robot's controllers.

    Args:
        client: Node that has the clients.
        spinner: Spins it.
        arm: Prefix of joints and frames.
    """

    def __init__(self, client, spinner, arm):
        super().__init__(client, spinner)
        self.joints, self.positions = arm_joints(arm), {}
        self.arm = ActionClient(
            client, FollowJointTrajectory, f"{arm}_arm_controller/follow_joint_trajectory"
        )
        self.gripper = ActionClient(client, GripperCommand, "franka_gripper/gripper_action")
        client.create_subscription(JointState, JOINT_STATES.name, self._hear, SENSOR_DATA)

    def destroy(self):
        self.arm.destroy()
        self.gripper.destroy()

    def _hear(self, message):
        assert len(message.velocity) == len(message.position) == len(message.name)
        self.positions = dict(zip(message.name, message.position, strict=True))

    def sent(self, client, goal):
        """The handle of a goal."""
        self.until(client.server_is_ready)
        return self.result(client.send_goal_async(goal))

    def ended(self, handle):
        """What came of a goal that was accepted."""
        return self.result(handle.get_result_async()).result

    def at(self):
        """Positions of the arm's joints, rad."""
        self.until(lambda: self.positions)
        return [self.positions[name] for name in self.joints]
