# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot in MuJoCo: an independent engine behind the interfaces of a real robot.

The arm lags behind its commands, fingers hold by friction, and bodies move by contact alone. Its
model is made from the task's initial state. Time passes as on a real robot, ``pace`` times faster,
or slower where the processor does not keep up; it stands still while nothing moves and nothing is
asked for.

ROS Parameters:
    domain (string, "obstacle_tower"), preset (string, ""), skills (string, ""), seed (int, 0),
        index (int, 0), goal (string, ""): the task in whose initial state it begins.
    arm (string, "panda"): prefix of joints and frames.
    trajectory_action (string, "ARM_arm_controller/follow_joint_trajectory"),
    gripper_action (string, "franka_gripper/gripper_action"): names of the actions, as the bridge's.
    gripper_scale (double, 0.5): position that is sent per m between the fingers.
    path_tolerance (double, 0.2), goal_tolerance (double, 0.05): rad, by which a joint may be off
        on the way and at the end, where a goal says nothing else; 0: any.
    stopped_velocity (double, 0.01): rad/s, of a joint that stands at the end.
    goal_time (double, 1.0): s, by which the arm may arrive late; 0: any time.
    trajectory_topic (string, "ARM_arm_controller/joint_trajectory"): topic of trajectories that
        replace one another, without an answer; ARM in it is replaced by the parameter arm.
    impedance (double, 0.0): N/m, with which the hand is pulled to where joint positions have it,
        by 60 N at most along each axis; 0: the joints themselves are pulled there.
    stiffness (double, 1.0): of the arm's joints, as a factor; the largest torques stay.
    lag (double, 0.07): s, by which a joint in motion is behind its command.
    latency (double, 0.02), jitter (double, 0.0): s, of goals and detections.
    pose_noise (double, 0.0): m, standard deviation of detections along each axis.
    turn_noise (double, 0.0): rad, standard deviation of detections about each axis.
    joint_noise (double, 0.0): rad, standard deviation of joint positions.
    dropout (double, 0.0): share of detections that are lost.
    rate (double, 30.0), joint_rate (double, 100.0): Hz, of detections and of joint positions.
    hidden (string, ""): an object that is never detected; NAME_moving for the part of a drawer or
        a lid that opens.
    pace (double, 1.0): how many times faster than a real one it moves.
    noise_seed (int, 0): noise and delays are a function of it.
    camera (bool, false): whether a camera with tags takes the place of exact frames.
    scene (string, ""): scene file with the tags, for the camera.
    camera_eye (double[3], [1.05, -0.45, 0.75]), camera_target (double[3], [0.5, -0.02, 0.15]): m,
        where the camera is and what it looks at, in the base's frame.
    camera_width (int, 1280), camera_height (int, 720), camera_focal (double, 1200.0): pixels.
    camera_rate (double, 5.0): Hz of pictures, at most.
    image_noise (double, 2.0): grey levels of 255; image_blur (double, 0.0): pixels; standard
        deviations.
    image_loss (double, 0.0): share of pictures that are lost.

Subscribers:
    trajectory_topic (trajectory_msgs/JointTrajectory).

Publishers:
    joint_states (sensor_msgs/JointState): of arm and fingers.
    tf (tf2_msgs/TFMessage): objects, as frames detected_NAME, and the part of a drawer or a lid
        that opens, as detected_NAME_moving; nothing where there is a camera.
    camera/image_rect (sensor_msgs/Image), camera/image_rect/compressed
        (sensor_msgs/CompressedImage), camera/camera_info (sensor_msgs/CameraInfo): with a camera.
    tf_static (tf2_msgs/TFMessage): the camera's optical frame, camera_optical_frame.
    diagnostics (diagnostic_msgs/DiagnosticArray): goals by outcome; 1 Hz.

Action servers:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand).
"""

from __future__ import annotations

from collections import Counter
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.node import Node

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.parameters import read_parameters
from ensemble.robot_parameters import MujocoRobotParameters
from ensemble.steady_time import create_timer
from robot_bridge.mujoco.controllers import MujocoArmController, MujocoGripperController
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.simulated.sensors import DetectionPublisher, JointStatePublisher
from slap_ros.robot.mujoco.arm import PERIOD_S
from slap_ros.robot.mujoco.impedance import arm_control
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.skills.domain_choice import open_domain

if TYPE_CHECKING:
    from robot_bridge.mujoco.camera import CameraPublisher

TICK = 0.01  # s, between two looks at how much time has to pass
BUSY = 0.005  # s of a tick that physics may take: callbacks need the rest


class MujocoRobot(Node):
    """The robot in MuJoCo."""

    def __init__(self, **kwargs: Any) -> None:
        """Start physics, controllers and detections.

        Args:
            kwargs: The node's.

        Raises:
            InvalidParameterError: A parameter has a value that it cannot have, or MuJoCo is not
                installed.
            InvalidSceneError: MuJoCo cannot express the scene.
        """
        super().__init__("mujoco_robot", **kwargs)
        settings = read_parameters(self, MujocoRobotParameters)
        noise = NoiseModel(settings)
        domain = open_domain(settings.choice)
        initial = settings.first_task(domain).initial_state
        self._camera: CameraPublisher | None = None
        if settings.camera:
            from robot_bridge.mujoco.camera import CameraPublisher, plant_with_camera

            self._plant, model = plant_with_camera(domain, initial, settings)
            self._camera = CameraPublisher(self, self._plant, model, settings)
        else:
            control = arm_control(settings.impedance, settings.stiffness, settings.lag)
            self._plant = MujocoPlant.of(domain, initial, control)
            self._detections = DetectionPublisher(self, self._plant, noise, settings)
        self._counts = Counter(motions=0, replaced=0, grips=0, refused=0, aborted=0, canceled=0)
        self._arm = MujocoArmController(self, self._plant, noise, settings, self._counts)
        self._gripper = MujocoGripperController(self, self._plant, noise, settings, self._counts)
        self._joints = JointStatePublisher(self, self._plant, noise, settings)
        self._pace, self._passed_s = settings.pace, monotonic()
        self._owed_s = 0.0  # time of the plant that has yet to pass
        create_timer(self, TICK, self._pass_time)
        DiagnosticsPublisher(self, lambda: self._counts)

    def destroy_node(self) -> None:
        """Destroy the action servers as well, and end the camera."""
        if self._camera is not None:
            self._camera.close()
        self._arm.destroy()
        self._gripper.destroy()
        super().destroy_node()

    def _pass_time(self) -> None:
        """Let as much time pass as has gone by, or as the processor has time for."""
        began = monotonic()
        self._owed_s += self._pace * (began - self._passed_s)
        self._passed_s = began
        while self._owed_s >= PERIOD_S and monotonic() - began < BUSY:
            self._owed_s -= PERIOD_S
            self._arm.update()
            self._gripper.update()
            if self._arm.busy or self._gripper.busy or not self._plant.at_rest:
                self._plant.step()
        self._owed_s = min(self._owed_s, PERIOD_S)


def main() -> int:
    """Run the node."""
    return run_node("mujoco_robot", MujocoRobot)
