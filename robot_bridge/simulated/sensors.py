# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated robot's sensors: joint states, and detections that are noisy, late and lost."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from itertools import count
from time import monotonic
from typing import Protocol

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.interfaces import JOINT_STATES, SENSOR_DATA, TF
from ensemble.robot_parameters import (
    SimulatedRobotParameters,
    arm_joints,
    base_frame,
    finger_joints,
)
from ensemble.steady_time import create_timer
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.transforms import transform
from slap_ros.geometry.pose import Pose
from slap_ros.robot.scene_config import DETECTED

DELIVERY_PERIOD = 0.005  # s, between two looks at which detections are due


class MeasuredPlant(Protocol):
    """What can be measured of a robot and the objects around it."""

    @property
    def joints(self) -> Sequence[float]:
        """Joint positions, rad."""
        ...

    @property
    def joint_velocities(self) -> Sequence[float]:
        """Joint velocities, rad/s; empty: not measured."""
        ...

    @property
    def gap(self) -> float:
        """Distance between the fingers, m."""
        ...

    def poses(self) -> Mapping[str, Pose]:
        """Where what can move is, by name."""
        ...


class JointStatePublisher:
    """Publishes the joint positions that encoders measure."""

    def __init__(
        self,
        node: Node,
        plant: MeasuredPlant,
        noise: NoiseModel,
        settings: SimulatedRobotParameters,
    ) -> None:
        """Begin to publish.

        Args:
            node: Publishes.
            plant: What is measured.
            noise: What comes between.
            settings: Rate, and the arm's name.
        """
        self._node, self._plant, self._noise = node, plant, noise
        self._frame = base_frame(settings.arm)
        self._names = [*arm_joints(settings.arm), *finger_joints(settings.arm)]
        self._joints = node.create_publisher(JOINT_STATES.type, JOINT_STATES.name, SENSOR_DATA)
        create_timer(node, 1.0 / settings.joint_rate, self._publish)

    def _publish(self) -> None:
        finger = 0.5 * self._plant.gap
        positions = [*self._noise.joints(self._plant.joints), finger, finger]
        velocities = [*measured, 0.0, 0.0] if (measured := self._plant.joint_velocities) else []
        header = Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)
        self._joints.publish(
            JointState(header=header, name=self._names, position=positions, velocity=velocities)
        )


class DetectionPublisher:
    """Publishes where objects are, with noise, a little after that is measured."""

    def __init__(
        self,
        node: Node,
        plant: MeasuredPlant,
        noise: NoiseModel,
        settings: SimulatedRobotParameters,
    ) -> None:
        """Begin to publish.

        Args:
            node: Publishes.
            plant: What is measured.
            noise: What comes between.
            settings: Rate, the arm's name, and what is never detected.
        """
        self._node, self._plant, self._noise, self._settings = node, plant, noise, settings
        self._frame = base_frame(settings.arm)
        self._pending: list[tuple[float, int, TransformStamped]] = []  # by the time they are due
        self._numbers = count()
        self._frames = node.create_publisher(TF.type, TF.name, TF.qos)
        create_timer(node, 1.0 / settings.rate, self._detect)
        create_timer(node, DELIVERY_PERIOD, self._deliver)

    def _detect(self) -> None:
        """Measure everything now; it is published a little later, not always in order."""
        now_s = monotonic()
        header = Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)
        for name, pose in self._plant.poses().items():
            if self._noise.dropped() or name == self._settings.hidden:
                continue
            item = transform(self._noise.perturbed(pose), f"{DETECTED}{name}")
            item.header = header
            due_s = now_s + self._noise.delay_s()
            heapq.heappush(self._pending, (due_s, next(self._numbers), item))

    def _deliver(self) -> None:
        now_s, due = monotonic(), []
        while self._pending and self._pending[0][0] <= now_s:
            due.append(heapq.heappop(self._pending)[2])
        if due:
            self._frames.publish(TFMessage(transforms=due))
