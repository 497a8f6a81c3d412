# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot that is not there: controllers, joint states and detections of a simulated world.

It moves the domain's world when its controllers are asked to, and lets time pass there for as long
as anything moves. For tests, and for trying the bridge out before there is a robot.

ROS Parameters:
    domain (string, "obstacle_tower"), preset (string, ""), skills (string, ""), seed (int, 0),
        index (int, 0), goal (string, ""): the task in whose initial state the world is.
    arm (string, "panda"): prefix of joints and frames.
    trajectory_action (string, "ARM_arm_controller/follow_joint_trajectory"),
    gripper_action (string, "franka_gripper/gripper_action"): names of the actions, as the bridge's.
    gripper_scale (double, 0.5): position that is sent per m between the fingers.
    latency (double, 0.02), jitter (double, 0.0): s, of goals and detections.
    pose_noise (double, 0.002): m, standard deviation of detections along each axis.
    turn_noise (double, 0.01): rad, standard deviation of detections about each axis.
    joint_noise (double, 0.0): rad, standard deviation of joint positions.
    dropout (double, 0.0): share of detections that are lost.
    rate (double, 30.0), joint_rate (double, 100.0): Hz, of detections and of joint positions.
    hidden (string, ""): an object that is never detected.
    pace (double, 1.0): how many times faster than a real one it moves.
    noise_seed (int, 0): noise and delays are a function of it.
    fault (string, ""): reject, abort, ignore or stand: what the arm's controller does to a motion,
    fault_after (int, 0): and after how many good ones.

Publishers:
    joint_states (sensor_msgs/JointState): of arm and fingers.
    tf (tf2_msgs/TFMessage): objects, as frames detected_NAME.
    diagnostics (diagnostic_msgs/DiagnosticArray): goals by outcome; 1 Hz.

Action servers:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand).
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.node import Node

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.parameters import read_parameters
from ensemble.robot_parameters import MockRobotParameters
from ensemble.steady_time import create_timer
from robot_bridge.mock.controllers import MockControllers
from robot_bridge.mock.plant import Plant
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.simulated.sensors import DetectionPublisher, JointStatePublisher
from slap_ros.errors import InvalidParameterError
from slap_ros.skills.domain_choice import open_domain

FAULTS = ("", "reject", "abort", "ignore", "stand")  # stand: it says that the arm has arrived


class MockRobot(Node):
    """The mock robot."""

    def __init__(self, **kwargs: Any) -> None:
        """Start controllers and detections of a simulated robot.

        Args:
            kwargs: The node's.

        Raises:
            InvalidParameterError: A parameter has a value that it cannot have.
        """
        super().__init__("mock_robot", **kwargs)
        settings = read_parameters(self, MockRobotParameters)
        if settings.fault not in FAULTS:
            raise InvalidParameterError(f"parameter fault is one of {', '.join(FAULTS[1:])}")
        if min(settings.rate, settings.joint_rate, settings.pace) <= 0.0:
            raise InvalidParameterError("parameters rate, joint_rate and pace must be above 0")
        domain = open_domain(settings.choice)
        period_s = domain.execution.control_period_s / settings.pace
        noise = NoiseModel(settings)
        self._plant = Plant(domain, settings.first_task(domain).initial_state)
        self._counts = Counter(motions=0, grips=0, refused=0, aborted=0, canceled=0)
        self._controllers = MockControllers(
            self, self._plant, noise, settings, period_s, self._counts
        )
        self._joints = JointStatePublisher(self, self._plant, noise, settings)
        self._detections = DetectionPublisher(self, self._plant, noise, settings)
        create_timer(self, period_s, self._idle)
        DiagnosticsPublisher(self, lambda: self._counts)

    def destroy_node(self) -> None:
        """Destroy the action servers as well."""
        self._controllers.destroy()
        super().destroy_node()

    def _idle(self) -> None:
        """Let time pass for objects that still move; a goal under way lets it pass by itself."""
        if not self._controllers.busy and not self._plant.at_rest:
            self._plant.idle()


def main() -> int:
    """Run the node."""
    return run_node("mock_robot", MockRobot)
