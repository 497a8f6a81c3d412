# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drives a Franka arm by its own protocol (franky, libfranka), or a simulated FR3 that speaks it.

Nothing moves but what a goal asks for. After a fault of the robot, the goal under way ends with its
code, the arm holds, and goals are refused until somebody calls ``~/recover``; nothing is tried
again. The arm also holds when its goal is canceled, when the node is stopped, and when nobody is
left of whoever sends goals.

ROS Parameters:
    ip (string, ""): address of the robot.
    simulated (bool, false): whether to start a simulated FR3, with the objects of the planner's
        model around it. ip must then be empty.
    domain (string, "obstacle_tower"), preset (string, ""), skills (string, ""), seed (int, 0),
        index (int, 0), goal (string, ""): the task in whose initial state a simulated arm begins.
    arm (string, "fr3"): prefix of joints and frames.
    trajectory_action (string, "ARM_arm_controller/follow_joint_trajectory"),
    gripper_action (string, "franka_gripper/gripper_action"): names of the actions, as the bridge's.
    gripper_scale (double, 0.5): position that is sent per m between the fingers.
    speed (double, 1.0): fraction of the limits of velocity, acceleration and jerk.
    collision_torque (double, 20.0): Nm about a joint, collision_force (double, 30.0): N on the
        hand, above which the robot's control stops the arm.
    realtime (bool, true): whether a real-time kernel is demanded; a simulated arm needs none.
    goal_tolerance (double, 0.05): rad, by which a joint may be off at the end of a motion.
    joint_rate (double, 100.0): Hz, of joint positions.
    clients (string, "robot_bridge robot_player"): nodes without which the arm holds, if one of them
        was there when its motion began.
    latency, jitter, pose_noise, turn_noise, dropout, rate, hidden, noise_seed: of detections of
        modelled objects, as the mock robot's.

Publishers:
    joint_states (sensor_msgs/JointState): of arm and fingers, as long as the robot answers.
    tf (tf2_msgs/TFMessage): the hand, as frame ARM_hand; modelled objects as detected_NAME.
    diagnostics (diagnostic_msgs/DiagnosticArray): goals by outcome, seconds of motion on the
        robot's clock, and the fault; 1 Hz.

Services:
    ~/recover (std_srvs/Trigger): ends a fault. For a person who has looked at the arm.

Action servers:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.interfaces import JOINT_STATES, SENSOR_DATA, TF
from ensemble.parameters import read_parameters
from ensemble.robot_parameters import (
    FrankaDriverParameters,
    arm_joints,
    base_frame,
    finger_joints,
)
from ensemble.steady_time import create_timer
from robot_bridge.franka.controllers import FrankaArmController, FrankaGripperController
from robot_bridge.franka.objects import ModelledObjects
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.simulated.sensors import DetectionPublisher
from robot_bridge.transforms import transform
from slap_ros.errors import InvalidParameterError, SlapError
from slap_ros.relational import State
from slap_ros.robot.franka.arm import ArmReading, FrankaArm
from slap_ros.robot.franka.installed import require_franky
from slap_ros.robot.franka.simulation import SimulatedFr3
from slap_ros.skills.domain_choice import open_domain
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.joint_space.features import ROBOT

CLIENT_PERIOD = 0.2  # s, between two looks at whether whoever sends goals is there


class FrankaDriver(Node):
    """The node that drives a Franka arm."""

    def __init__(self, **kwargs: Any) -> None:
        """Connect to the robot, or start a simulated one; nothing moves.

        Args:
            kwargs: The node's.

        Raises:
            InvalidParameterError: A parameter has a value that it cannot have, or franky or
                franky-sim is not installed.
            SlapError: The robot cannot be reached, or another program drives it.
        """
        super().__init__("franka_driver", **kwargs)
        settings = read_parameters(self, FrankaDriverParameters)
        require_franky()
        self._settings = settings
        self._simulation: SimulatedFr3 | None = None
        self._objects: ModelledObjects | None = None
        if settings.simulated == bool(settings.ip):
            raise InvalidParameterError(
                "franka_driver needs the address of a robot, ip=172.16.0.2, or simulated=true"
            )
        if settings.simulated:
            self._simulate()
        else:
            self._arm = FrankaArm(settings.franka)
        self._counts = Counter(motions=0, grips=0, refused=0, aborted=0, canceled=0, recoveries=0)
        self._motions = FrankaArmController(self, self._arm, settings, self._counts)
        self._grips = FrankaGripperController(
            self, self._arm, self._objects, settings, self._counts
        )
        self._states = ReadingPublisher(self, self._arm, settings)
        self._clients: set[str] = set()  # of those named, the ones that were there last
        create_timer(self, CLIENT_PERIOD, self._look_for_clients)
        self.create_service(Trigger, "~/recover", self._recover)
        DiagnosticsPublisher(self, self._diagnostics)

    def destroy_node(self) -> None:
        """Bring the arm to rest, disconnect, and end a simulated robot."""
        for controller in ("_motions", "_grips"):
            if hasattr(self, controller):
                getattr(self, controller).destroy()
        if hasattr(self, "_arm"):
            self._arm.close()
        if self._simulation is not None:
            self._simulation.close()
        super().destroy_node()

    def _simulate(self) -> None:
        """Start a simulated arm, and put the objects of the planner's model around it."""
        settings = self._settings
        domain = open_domain(settings.choice)
        initial = settings.first_task(domain).initial_state
        self._simulation = SimulatedFr3(_joints(initial))
        try:
            self._arm = FrankaArm(replace(settings.franka, ip=self._simulation.ip, realtime=False))
        except SlapError:
            self._simulation.close()
            raise
        self._objects = ModelledObjects(domain, initial, self._arm)
        noise = NoiseModel(settings)
        self._detections = DetectionPublisher(self, self._objects, noise, settings)
        create_timer(self, domain.execution.control_period_s, self._objects.follow)

    def _look_for_clients(self) -> None:
        """Hold when nobody is left of whoever was there to send goals."""
        there = set(self._settings.clients.split()) & set(self.get_node_names())
        if self._motions.busy and self._clients and not there:
            self.get_logger().warning(f"{', '.join(self._clients)} is gone: the arm holds")
            self._arm.hold()
        self._clients = there

    def _recover(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            self._arm.recover()
        except SlapError as error:
            response.success, response.message = False, f"{error.code.name}: {error}"
        else:
            self._counts["recoveries"] += 1
            response.success, response.message = True, "goals are accepted again"
        return response

    def _diagnostics(self) -> dict[str, object]:
        fault = self._arm.fault
        return {
            **self._counts,
            "moved_s": round(self._motions.moved_s, 3),
            "fault": "" if fault is None else f"{fault.code.name}: {fault}",
        }


class ReadingPublisher:
    """Publishes what is read of the robot: nothing where nothing new was read."""

    def __init__(self, node: Node, arm: FrankaArm, settings: FrankaDriverParameters) -> None:
        """Begin to publish.

        Args:
            node: Publishes.
            arm: What is read.
            settings: Rate, and the arm's name.
        """
        self._node, self._arm = node, arm
        self._base, self._hand = base_frame(settings.arm), f"{settings.arm}_hand"
        self._names = [*arm_joints(settings.arm), *finger_joints(settings.arm)]
        self._joints = node.create_publisher(JOINT_STATES.type, JOINT_STATES.name, SENSOR_DATA)
        self._frames = node.create_publisher(TF.type, TF.name, TF.qos)
        self._last: ArmReading | None = None
        create_timer(node, 1.0 / settings.joint_rate, self._publish)

    def _publish(self) -> None:
        reading = self._arm.reading
        if reading is self._last:
            return
        self._last = reading
        header = Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._base)
        finger = 0.5 * reading.gap
        self._joints.publish(
            JointState(
                header=header,
                name=self._names,
                position=[*reading.joints, finger, finger],
                velocity=[*reading.velocities, 0.0, 0.0],
            )
        )
        hand: TransformStamped = transform(reading.hand, self._hand)
        hand.header = header
        self._frames.publish(TFMessage(transforms=[hand]))


def _joints(state: State) -> list[float]:
    """Joint positions of the robot of a state, rad."""
    (robot,) = state.layout.of_type(ROBOT)
    return [float(state.get(robot, feature.name)) for feature in JOINT_FEATURES]


def main() -> int:
    """Run the node."""
    return run_node("franka_driver", FrankaDriver)
