# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the robot's side publishes, into measurements of the core."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Protocol

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.interfaces import JOINT_STATES, SENSOR_DATA, TF, TF_STATIC
from ensemble.robot_parameters import RobotParameters, arm_joints, base_frame, finger_joints
from ensemble.steady_time import JumpFreeClock
from slap_ros.errors import InvalidMeasurementError, NoJointStateError
from slap_ros.geometry.pose import Pose
from slap_ros.geometry.static_transforms import StaticTransforms
from slap_ros.messages.decode import NANOSECONDS, stamp_ns
from slap_ros.robot.joint_reading import JointLists, JointReading, gap_between, require_radians
from slap_ros.robot.limits import arm_limits
from slap_ros.robot.tracking import measured_pose
from slap_ros.vision.tags import SEARCHED

AHEAD = 0.05  # s, by which clocks of machines may differ
QUIET = 10.0  # s between two log lines about joint states: a driver sends hundreds a second


class MeasuredRobot(Protocol):
    """What takes measurements; each may refuse one with an InvalidMeasurementError."""

    @property
    def newest_joints_s(self) -> float:
        """Stamp of the newest joint positions, s; minus infinity without any."""
        ...

    def add_joint_reading(self, reading: JointReading) -> None:
        """Take joint positions."""
        ...

    def add_detection(self, frame: str, stamp_s: float, base: Pose, seen: Pose) -> None:
        """Take where a frame is detected.

        Args:
            frame: Name of the child frame.
            stamp_s: Time of the measurement, s.
            base: Pose of the parent frame in the base's frame.
            seen: Pose of the child frame in its parent.
        """
        ...

    def add_picture(self, stamp_s: float) -> None:
        """Take that a picture was searched."""
        ...


class Sensors:
    """Gives joint positions and detections to a robot's world; counts what that refuses."""

    def __init__(
        self, node: Node, world: MeasuredRobot, settings: RobotParameters, clock: JumpFreeClock
    ) -> None:
        """Subscribe to joint states and frames.

        Args:
            node: Node that subscribes.
            world: What takes the measurements.
            settings: Parameters of the robot.
            clock: What measurements are dated by.

        Raises:
            InvalidParameterError: An unknown arm.
        """
        self._node, self._world, self._clock = node, world, clock
        self._joint_timeout, arm = settings.joint_timeout, settings.arm
        self._arm, self._fingers = arm_joints(arm), finger_joints(arm)
        self._limits = arm_limits(arm)
        self._frames = StaticTransforms(base_frame(arm))
        self.counts: Counter[str] = Counter(readings=0, detections=0, refused_measurements=0)
        self.gap: float | None = None  # m, between the fingers
        self.gap_s = -math.inf  # when the gap was measured
        self._joint_refusal: InvalidMeasurementError | None = None  # since the last good reading
        node.create_subscription(JOINT_STATES.type, JOINT_STATES.name, self._on_joints, SENSOR_DATA)
        node.create_subscription(TF.type, TF.name, self._on_frames, SENSOR_DATA)
        node.create_subscription(TF_STATIC.type, TF_STATIC.name, self._on_static, TF_STATIC.qos)

    def require_joints(self, since_s: float = -math.inf) -> None:
        """Refuse to go on without news of where the joints are.

        Args:
            since_s: When news were asked for; s, of the clock.

        Raises:
            NoJointStateError: There were none for ``joint_timeout``.
        """
        silence = self._clock.now_s() - max(self._world.newest_joints_s, since_s)
        if silence > self._joint_timeout:
            raise NoJointStateError(f"no joint positions for {silence:.1f} s{self.joint_advice}")

    @property
    def joint_advice(self) -> str:
        """Why joint states were not used, for messages that miss them; empty where none came."""
        return f": they are refused, as {self._joint_refusal}" if self._joint_refusal else ""

    def _on_joints(self, message: JointState) -> None:
        """The arm's joints, the fingers', or both; others are ignored."""
        try:
            stamp_s = self._stamp_s(message.header)
            joints = JointLists(message.name, message.position, message.velocity, message.effort)
            self._take_fingers(joints.position, stamp_s)
            self._take_arm(joints, stamp_s)
        except InvalidMeasurementError as error:
            self._joint_refusal = error
            self.counts["refused_measurements"] += 1
            self._node.get_logger().warning(f"refused: {error}", throttle_duration_sec=QUIET)

    def _take_fingers(self, at: Mapping[str, float], stamp_s: float) -> None:
        if all(name in at for name in self._fingers):
            self.gap = gap_between([at[name] for name in self._fingers])
            self.gap_s = stamp_s

    def _take_arm(self, joints: JointLists, stamp_s: float) -> None:
        at, speed = joints.position, joints.velocity
        if not all(name in at for name in self._arm):
            return
        positions = tuple(at[name] for name in self._arm)
        require_radians(positions, self._limits.low, self._limits.high)
        velocities = tuple(speed[name] for name in self._arm if name in speed)
        if all(map(math.isnan, velocities)):
            velocities = ()  # ros2_control's joint_state_broadcaster: not measured
        self._world.add_joint_reading(JointReading(stamp_s, positions, velocities, self.gap))
        self._joint_refusal = None
        self.counts["readings"] += 1

    def _on_static(self, message: TFMessage) -> None:
        for item in message.transforms:
            try:
                pose = measured_pose(*_parts(item))
            except InvalidMeasurementError as error:
                self._refuse(error)
            else:
                self._frames.add(item.header.frame_id, item.child_frame_id, pose)

    def _on_frames(self, message: TFMessage) -> None:
        for item in message.transforms:
            base = self._frames.in_base(item.header.frame_id)
            if base is None:
                continue  # not seen from the robot
            position, quaternion = _parts(item)
            try:
                stamp_s = self._stamp_s(item.header)
                if item.child_frame_id == SEARCHED:
                    self._world.add_picture(stamp_s)
                    continue
                self._world.add_detection(
                    item.child_frame_id, stamp_s, base, Pose(position, quaternion)
                )
            except InvalidMeasurementError as error:
                self._refuse(error)
            else:
                self.counts["detections"] += 1

    def _stamp_s(self, header: Header) -> float:
        """When something was measured, s of ``clock``.

        From a clock that is ahead, what is older than the last motion would look newer.

        Raises:
            InvalidMeasurementError: That is unknown or to come.
        """
        of = f"a measurement of {header.frame_id or 'joints'}"
        if stamp_ns(header) == 0 or not 0 <= header.stamp.nanosec < NANOSECONDS:
            raise InvalidMeasurementError(f"{of} has no stamp")
        stamp_s = self._clock.of_stamp(stamp_ns(header) / NANOSECONDS)
        ahead_s = stamp_s - self._clock.now_s()
        if ahead_s > AHEAD:
            raise InvalidMeasurementError(
                f"{of} is {ahead_s:.3f} s ahead: are clocks synchronised?"
            )
        return stamp_s

    def _refuse(self, error: InvalidMeasurementError) -> None:
        self.counts["refused_measurements"] += 1
        self._node.get_logger().debug(f"refused: {error}")


def _parts(
    item: TransformStamped,
) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    t, q = item.transform.translation, item.transform.rotation
    return (t.x, t.y, t.z), (q.x, q.y, q.z, q.w)
