# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The controllers of the robot in MuJoCo: action servers, and what they do in each period.

They answer as drivers do: ros2_control's joint_trajectory_controller, and a gripper that succeeds
where its fingers stall, and says that they did.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from control_msgs.action import FollowJointTrajectory, GripperCommand
from control_msgs.msg import JointTolerance
from rclpy.action import GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory

from ensemble.interfaces import VOLATILE
from ensemble.robot_parameters import MujocoRobotParameters, action_name, arm_joints
from robot_bridge.action_servers import arm_server, gripper_server
from robot_bridge.goals import GoalUnderWay, is_finite, points_of, trajectory_points
from robot_bridge.simulated.noise_model import NoiseModel
from robot_bridge.simulated.waiting import pause
from slap_ros.errors import InvalidCommandError
from slap_ros.messages.decode import stamp_ns
from slap_ros.robot.finger_tracking import FingerTracker, GripOutcome
from slap_ros.robot.joint_trajectory import TrajectoryPoint, require_followable
from slap_ros.robot.mujoco.arm import FINGER_FORCE
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.trajectory_tracking import (
    TrajectoryCode,
    TrajectoryOutcome,
    TrajectoryTolerances,
    TrajectoryTracker,
)

UNCHECKED = -1.0  # of a goal's tolerance: any
PREEMPTED = TrajectoryOutcome(TrajectoryCode.INVALID_GOAL, "another goal came")
CANCELED = TrajectoryOutcome(TrajectoryCode.SUCCESSFUL, "canceled")


class MujocoArmController:
    """The arm's controller: one trajectory at a time, by action or topic; a new one replaces it."""

    def __init__(
        self,
        node: Node,
        plant: MujocoPlant,
        noise: NoiseModel,
        settings: MujocoRobotParameters,
        counts: Counter[str],
    ) -> None:
        """Open the action server.

        Args:
            node: Node that has the server.
            plant: What it moves.
            noise: Noise model that draws how late each motion begins.
            settings: Parameters of the robot.
            counts: Where goals are counted by outcome.
        """
        self._node, self._plant, self._noise = node, plant, noise
        self._settings, self._counts = settings, counts
        self._joints = arm_joints(settings.arm)
        self._tracker = TrajectoryTracker(plant.joints)
        self._goal = GoalUnderWay()
        self._server = arm_server(node, settings, self._move, self._on_goal)
        topic = action_name(settings.trajectory_topic, settings.arm)
        node.create_subscription(JointTrajectory, topic, self._on_trajectory, VOLATILE)

    def destroy(self) -> None:
        """Destroy the action server."""
        self._server.destroy()

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        return self._tracker.busy

    def update(self) -> None:
        """Command the arm for the next period, or end the motion under way."""
        if not self._tracker.busy:
            return  # it holds what it was commanded last
        plant = self._plant
        if self._goal.is_cancel_requested:
            self._tracker.hold(plant.joints)
            self._goal.end(CANCELED)
        outcome = self._tracker.check(plant.time_s, plant.joints, plant.joint_velocities)
        if outcome is not None:
            self._goal.end(outcome)
        plant.command(self._tracker.command(plant.time_s))

    def _on_goal(self, goal: FollowJointTrajectory.Goal) -> GoalResponse:
        try:
            self._require_followable(goal.trajectory)
            self._require_to_come(goal)
        except InvalidCommandError as error:
            self._refuse(error)
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _require_followable(self, trajectory: JointTrajectory) -> None:
        points = trajectory_points(trajectory)
        require_followable(trajectory.joint_names, self._joints, points)

    def _refuse(self, error: InvalidCommandError) -> None:
        self._counts["refused"] += 1
        self._node.get_logger().warning(f"refused: {error}")

    def _on_trajectory(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory of the topic, which nobody is told the end of."""
        try:
            self._require_followable(trajectory)
        except InvalidCommandError as error:
            self._refuse(error)
        else:
            self._counts["replaced"] += self._tracker.busy
            self._node.executor.create_task(self._follow(points_of(trajectory, self._joints)))

    async def _follow(self, points: Sequence[TrajectoryPoint]) -> None:
        await pause(self._node, self._noise.delay_s())
        self._goal.end(PREEMPTED)
        plant, tolerances = self._plant, self._usual_tolerances
        taken = plant.control.replacing(points)
        self._tracker.start(taken, tolerances, plant.time_s, plant.joints, plant.joint_velocities)

    def _require_to_come(self, goal: FollowJointTrajectory.Goal) -> None:
        """Refuse a trajectory that was to end in the past."""
        if self._late_s(goal) > trajectory_points(goal.trajectory)[-1].time_s:
            raise InvalidCommandError("the trajectory was to end in the past")

    def _late_s(self, goal: FollowJointTrajectory.Goal) -> float:
        """How long ago the trajectory was to start, s of the plant; 0 without a stamp."""
        stamp = stamp_ns(goal.trajectory.header)
        if stamp == 0:
            return 0.0
        return (self._node.get_clock().now().nanoseconds - stamp) * 1e-9 * self._settings.pace

    async def _move(self, handle: ServerGoalHandle) -> FollowJointTrajectory.Result:
        await pause(self._node, self._noise.delay_s())
        self._goal.end(PREEMPTED)
        goal, plant = handle.request, self._plant
        self._tracker.start(
            points_of(goal.trajectory, self._joints),
            self._tolerances(goal),
            plant.time_s - self._late_s(goal),
            plant.joints,
            plant.joint_velocities,
        )
        outcome: TrajectoryOutcome = await self._goal.begin(handle)
        return self._result(handle, outcome)

    def _result(
        self, handle: ServerGoalHandle, outcome: TrajectoryOutcome
    ) -> FollowJointTrajectory.Result:
        if outcome is CANCELED:
            self._counts["canceled"] += 1
            handle.canceled()
        elif outcome.code is TrajectoryCode.SUCCESSFUL:
            self._counts["motions"] += 1
            handle.succeed()
        else:
            self._counts["aborted"] += 1
            handle.abort()
        return FollowJointTrajectory.Result(
            error_code=int(outcome.code), error_string=outcome.reason
        )

    @property
    def _usual_tolerances(self) -> TrajectoryTolerances:
        """The node's own."""
        settings = self._settings
        return TrajectoryTolerances(
            (settings.path_tolerance,) * len(self._joints),
            (settings.goal_tolerance,) * len(self._joints),
            settings.stopped_velocity,
            settings.goal_time,
        )

    def _tolerances(self, goal: FollowJointTrajectory.Goal) -> TrajectoryTolerances:
        """The node's, where the goal does not have its own."""
        settings, time = self._settings, goal.goal_time_tolerance
        late_s = time.sec + time.nanosec * 1e-9
        return TrajectoryTolerances(
            self._positions(goal.path_tolerance, settings.path_tolerance),
            self._positions(goal.goal_tolerance, settings.goal_tolerance),
            settings.stopped_velocity,
            0.0 if late_s < 0.0 else late_s or settings.goal_time,
        )

    def _positions(self, given: Sequence[JointTolerance], otherwise: float) -> tuple[float, ...]:
        """Tolerances by joint: 0 stands for the node's, -1 for none."""
        own = {item.name: item.position for item in given if item.position != 0.0}
        wanted = [own.get(name, otherwise) for name in self._joints]
        return tuple(0.0 if value == UNCHECKED else value for value in wanted)


class MujocoGripperController:
    """The gripper's controller: one motion of the fingers at a time."""

    def __init__(
        self,
        node: Node,
        plant: MujocoPlant,
        noise: NoiseModel,
        settings: MujocoRobotParameters,
        counts: Counter[str],
    ) -> None:
        """Open the action server.

        Args:
            node: Node that has the server.
            plant: What it moves.
            noise: Noise model that draws how late each motion begins.
            settings: Parameters of the robot.
            counts: Where goals are counted by outcome.
        """
        self._node, self._plant, self._noise = node, plant, noise
        self._scale, self._counts = settings.gripper_scale, counts
        self._tracker = FingerTracker()
        self._goal = GoalUnderWay()
        self._server = gripper_server(node, settings, self._grip, self._on_goal)

    def destroy(self) -> None:
        """Destroy the action server."""
        self._server.destroy()

    @property
    def busy(self) -> bool:
        """Whether the fingers are moving to where they were told to be."""
        return self._tracker.busy

    def update(self) -> None:
        """End the motion under way where it is over."""
        if not self._tracker.busy:
            return
        plant = self._plant
        if self._goal.is_cancel_requested:
            self._tracker.stop()
            plant.command_fingers(0.5 * plant.gap)
            self._goal.end(None)
        outcome = self._tracker.check(plant.time_s, plant.gap, plant.gap_velocity)
        if outcome is not None:
            self._goal.end(outcome)

    def _on_goal(self, goal: GripperCommand.Goal) -> GoalResponse:
        if not is_finite(goal):
            self._counts["refused"] += 1
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _grip(self, handle: ServerGoalHandle) -> GripperCommand.Result:
        await pause(self._node, self._noise.delay_s())
        self._goal.end(None)
        command = handle.request.command
        gap = command.position / self._scale
        force = command.max_effort if command.max_effort > 0.0 else FINGER_FORCE
        self._plant.command_fingers(0.5 * gap, force)
        self._tracker.start(gap, self._plant.time_s)
        outcome: GripOutcome | None = await self._goal.begin(handle)
        return self._result(handle, outcome)

    def _result(
        self, handle: ServerGoalHandle, outcome: GripOutcome | None
    ) -> GripperCommand.Result:
        if outcome is not None:
            self._counts["grips"] += 1
            handle.succeed()
        elif handle.is_cancel_requested:
            self._counts["canceled"] += 1
            handle.canceled()
        else:  # replaced by another goal
            self._counts["aborted"] += 1
            handle.abort()
        return GripperCommand.Result(
            position=self._plant.gap * self._scale,
            stalled=outcome is GripOutcome.STALLED,
            reached_goal=outcome is GripOutcome.REACHED,
        )
