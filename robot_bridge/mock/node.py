# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot that is not there: controllers, joint states and detections of a simulated cell.

It moves the domain's world when its controllers are asked to, and lets time pass there for as long
as anything moves. For tests, and for trying the bridge out before there is a robot.

ROS Parameters:
    domain (string, "obstacle_tower"), preset (string, "fair"), seed (int, 0), index (int, 0): the
        task in whose initial state the cell is.
    arm (string, "panda"): prefix of joints and frames.
    trajectory_action, gripper_action (string): names of the actions, as the bridge's.
    gripper_scale (double, 0.5): position that is sent for each m between the fingers.
    latency (double, 0.02), jitter (double, 0.0): s, of goals and detections.
    pose_noise (double, 0.002): m, standard deviation of detections along each axis.
    turn_noise (double, 0.01): rad, standard deviation of detections about each axis.
    joint_noise (double, 0.0): rad, standard deviation of joint positions.
    dropout (double, 0.0): share of detections that are lost.
    rate (double, 30.0), joint_rate (double, 100.0): Hz, of detections and of joint positions.
    hidden (string, ""): an object that is never detected.
    pace (double, 1.0): how many times faster than a real one it moves.
    noise_seed (int, 0): noise and delays are a function of it.
    fault (string, ""): reject, abort or ignore: what the arm's controller does to a motion,
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

import heapq
from collections import Counter
from itertools import count
from typing import Any

import numpy as np
from control_msgs.action import FollowJointTrajectory, GripperCommand
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import node_time_s
from ensemble.interfaces import JOINT_STATES, TF
from ensemble.parameters import read_parameters
from ensemble.robot_parameters import MockRobotParameters, action_name
from robot_bridge.mock.noise_model import NoiseModel, NoiseSettings
from robot_bridge.mock.plant import Plant
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose
from slap_ros.robot.scene_config import DETECTED

POST_PERIOD = 0.005  # s, between two looks at what is due to be published
FAULTS = ("", "reject", "abort", "ignore")


class MockRobot(Node):
    """The mock robot."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("mock_robot", **kwargs)
        self._settings = settings = read_parameters(self, MockRobotParameters)
        if settings.fault not in FAULTS:
            raise InvalidParameterError(f"parameter fault is one of {', '.join(FAULTS[1:])}")
        if min(settings.rate, settings.joint_rate, settings.pace) <= 0.0:
            raise InvalidParameterError("parameters rate, joint_rate and pace must be above 0")
        domain = get_domain(settings.domain, settings.preset)
        self._period_s = domain.execution.control_period_s / settings.pace
        self._plant = Plant(domain, domain.task(settings.seed, settings.index).initial_state)
        self._noise = NoiseModel(
            _noise_settings(settings), np.random.default_rng(settings.noise_seed)
        )
        self._counts = Counter(motions=0, grips=0, refused=0, aborted=0, canceled=0)
        self._busy = False  # a goal is under way, which makes the time pass
        self._post: list[tuple[float, int, TransformStamped]] = []  # by the time they are due
        self._numbers = count()
        self._frames = self.create_publisher(TF.type, TF.name, TF.qos)
        self._joints = self.create_publisher(JOINT_STATES.type, JOINT_STATES.name, JOINT_STATES.qos)
        self._arm = ActionServer(
            self,
            FollowJointTrajectory,
            action_name(settings.trajectory_action, settings.arm),
            self._move,
            goal_callback=self._on_motion,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self._gripper = ActionServer(
            self,
            GripperCommand,
            action_name(settings.gripper_action, settings.arm),
            self._grip,
        )
        self.create_timer(1.0 / settings.joint_rate, self._tell_joints)
        self.create_timer(1.0 / settings.rate, self._detect)
        self.create_timer(POST_PERIOD, self._deliver)
        self.create_timer(self._period_s, self._pass_time)
        DiagnosticsPublisher(self, lambda: self._counts)

    def destroy_node(self) -> None:
        """Destroy the action servers as well."""
        self._arm.destroy()
        self._gripper.destroy()
        super().destroy_node()

    # -- controllers ----------------------------------------------------------------------------

    def _on_motion(self, goal: FollowJointTrajectory.Goal) -> GoalResponse:
        broken = self._settings.fault == "reject" and self._faulty
        if self._busy or broken or list(goal.trajectory.joint_names) != self._arm_joints:
            self._counts["refused"] += 1
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    @property
    def _faulty(self) -> bool:
        return self._counts["motions"] >= self._settings.fault_after

    @property
    def _arm_joints(self) -> list[str]:
        return [f"{self._settings.arm}_joint{i + 1}" for i in range(7)]

    async def _move(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        self._busy = True
        try:
            return await self._follow(goal)
        finally:
            self._busy = False

    async def _follow(self, goal: ServerGoalHandle) -> FollowJointTrajectory.Result:
        result = FollowJointTrajectory.Result()
        point = goal.request.trajectory.points[-1]
        lasts_s = point.time_from_start.sec + point.time_from_start.nanosec * 1e-9
        await pause(self, self._noise.delay_s())
        if self._settings.fault == "abort" and self._faulty:
            self._counts["aborted"] += 1
            goal.abort()
            result.error_code = FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
            result.error_string = "told to fail"
            return result
        ignored = self._settings.fault == "ignore" and self._faulty
        periods = self._plant.periods_to(point.positions)
        done = 0
        while ignored or done < periods:
            await pause(self, lasts_s / periods / self._settings.pace)
            if goal.is_cancel_requested:
                self._counts["canceled"] += 1
                goal.canceled()
                return result
            if not ignored:
                self._plant.approach(point.positions)
                done += 1
        self._counts["motions"] += 1
        goal.succeed()
        return result

    async def _grip(self, goal: ServerGoalHandle) -> GripperCommand.Result:
        self._busy = True
        try:
            await pause(self, self._noise.delay_s() + self._period_s)
            wanted = goal.request.command.position / self._settings.gripper_scale
            self._plant.move_fingers(shut=wanted < self._plant.gap)
        finally:
            self._busy = False
        self._counts["grips"] += 1
        goal.succeed()
        return GripperCommand.Result(
            position=self._plant.gap * self._settings.gripper_scale,
            stalled=self._plant.holding,
            reached_goal=not self._plant.holding,
        )

    def _pass_time(self) -> None:
        if not self._busy and not self._plant.still:
            self._plant.idle()

    # -- sensors --------------------------------------------------------------------------------

    def _tell_joints(self) -> None:
        finger = 0.5 * self._plant.gap
        arm = self._settings.arm
        self._joints.publish(
            JointState(
                header=Header(stamp=self.get_clock().now().to_msg(), frame_id=f"{arm}_link0"),
                name=[*self._arm_joints, f"{arm}_finger_joint1", f"{arm}_finger_joint2"],
                position=[*self._noise.joints(self._plant.joints), finger, finger],
            )
        )

    def _detect(self) -> None:
        """See everything now; it will be known a little later, not always in order."""
        now_s, stamp = node_time_s(self), self.get_clock().now().to_msg()
        for name, pose in self._plant.poses().items():
            if self._noise.dropped() or name == self._settings.hidden:
                continue
            item = transform(self._noise.seen(pose), f"{DETECTED}{name}")
            item.header = Header(stamp=stamp, frame_id=f"{self._settings.arm}_link0")
            heapq.heappush(self._post, (now_s + self._noise.delay_s(), next(self._numbers), item))

    def _deliver(self) -> None:
        now_s, due = node_time_s(self), []
        while self._post and self._post[0][0] <= now_s:
            due.append(heapq.heappop(self._post)[2])
        if due:
            self._frames.publish(TFMessage(transforms=due))


async def pause(node: Node, duration_s: float) -> None:
    """Wait without blocking the executor."""
    over = Future()
    timer = node.create_timer(max(duration_s, 1e-3), lambda: over.done() or over.set_result(None))
    try:
        await over
    finally:
        node.destroy_timer(timer)


def transform(pose: Pose, child: str) -> TransformStamped:
    """A pose as a transform."""
    x, y, z = pose.position
    qx, qy, qz, qw = pose.quaternion
    return TransformStamped(
        child_frame_id=child,
        transform=Transform(
            translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)
        ),
    )


def _noise_settings(settings: MockRobotParameters) -> NoiseSettings:
    return NoiseSettings(
        settings.latency,
        settings.jitter,
        settings.pose_noise,
        settings.turn_noise,
        settings.joint_noise,
        settings.dropout,
    )


def main() -> int:
    """Run the node."""
    return run_node("mock_robot", MockRobot)
