# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executes a recorded plan on a robot, open loop: ``slap bag replay BAG --to robot``.

It measures the whole state once before it begins, and once when it is done. In between it trusts
the recording for everything but the arm's own joints, fingers and controllers: the first of these
that fails ends the replay, and nothing more is sent, so that the controllers hold.

ROS Parameters:
    none: whatever makes the node gives it ``ensemble.robot_parameters.PlayerParameters``.

Subscribers:
    joint_states (sensor_msgs/JointState), tf, tf_static (tf2_msgs/TFMessage): as robot_bridge.

Action clients:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand): as robot_bridge.
"""

from __future__ import annotations

import math
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

from ensemble.futures import wait_for_first
from ensemble.robot_parameters import PlayerParameters
from robot_bridge.robot import Robot
from slap_ros.errors import (
    ControllerAbortedError,
    ControllerTimeoutError,
    InvalidStateError,
    NoJointStateError,
    SlapError,
    StartMismatchError,
)
from slap_ros.relational import State
from slap_ros.robot.blended_run import BlendedRun
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.recorded_motion import RecordedMotion, RecordedWaypoint
from slap_ros.robot.stretches import Stretch
from slap_ros.worlds.features import POSE_FEATURES

POSITION = tuple(feature.name for feature in POSE_FEATURES[:3])


class Player(Node):
    """Plays one recording."""

    def __init__(
        self, recorded: RecordedMotion, dry_run: DryRun, settings: PlayerParameters, **kwargs: Any
    ) -> None:
        """Connect to the robot; nothing moves before :meth:`play`.

        Args:
            recorded: What to execute.
            dry_run: Dry run of ``recorded``, within the limits of this robot.
            settings: Parameters of the robot.
            kwargs: The node's.

        Raises:
            UnsafeCommandError: The dry run says that it must not be executed.
        """
        dry_run.require_safe()
        super().__init__("robot_player", **kwargs)
        self._recorded, self._settings = recorded, settings
        self._stretches = stretches_of(recorded, dry_run)
        self._robot = Robot(self, recorded.domain, lambda: recorded.states[0], settings)
        self.failure: SlapError | None = None
        self.done = 0  # steps
        self.final: State | None = None  # as measured at the end; None where something is held

    def destroy_node(self) -> None:
        """Hold, and release what the robot's clients use."""
        self._robot.destroy()
        super().destroy_node()

    def hold(self) -> None:
        """Have the motion under way canceled."""
        self._robot.controllers.hold()

    async def play(self) -> None:
        """Execute the recording; why it ended early, if it did, is in ``failure``."""
        try:
            await self._begin()
            for stretch in self._stretches:
                await self._execute(stretch)
                self.done += len(stretch.waypoints)
            if not any(_held(self._recorded.states[-1], name) for name in self._names):
                self.final = await self._measure("at the end")
        except SlapError as error:
            self.hold()
            self.failure = error

    # -- before the first motion ----------------------------------------------------------------

    @property
    def _names(self) -> list[str]:
        """Objects that can be moved."""
        return [o.name for o in self._recorded.states[0].objects if "held" in o.type.column]

    async def _begin(self) -> None:
        """Wait for the robot; refuse to begin elsewhere than the recording does."""
        end = self._robot.clock.now_s() + self._settings.start_timeout
        await wait_for_first(
            self, Future(), lambda: self._robot.controllers.ready or self._robot.clock.now_s() > end
        )
        if not self._robot.controllers.ready:
            raise ControllerTimeoutError("the controllers are not there: are they running?")
        state = await self._measure("at the start")
        off = self._robot.world.joint_distance(self._recorded.start)
        if off > self._settings.start_tolerance:
            raise StartMismatchError(
                f"a joint is {off:.3f} rad off where the recording begins, which may be "
                f"{self._settings.start_tolerance} rad: move the arm there first"
            )
        for name in self._names:
            self._require_place(name, state)

    def _require_place(self, name: str, state: State) -> None:
        first = self._recorded.states[0]
        if name not in state.layout.by_name:
            raise StartMismatchError(f"the recording is about {name}, which the scene has not")
        there, recorded = (
            [float(s.get(s.layout.object(name), axis)) for axis in POSITION] for s in (state, first)
        )
        off = math.dist(there, recorded)
        if off > self._settings.place_tolerance:
            place = ", ".join(f"{value:.3f}" for value in recorded)
            raise StartMismatchError(
                f"{name} is {off:.3f} m off where the recording begins, which may be "
                f"{self._settings.place_tolerance} m: put it to ({place})"
            )

    async def _measure(self, when: str) -> State:
        """The state, measured from now on."""
        since_s = self._robot.clock.now_s()
        end_s = since_s + self._settings.start_timeout
        found: list[State] = []
        reasons: list[InvalidStateError] = []

        def measure() -> bool:
            try:
                state = self._robot.world.measure(since_s)
            except InvalidStateError as error:
                reasons.append(error)
            else:
                found.extend([state] if state is not None else [])
            return bool(found) or self._robot.clock.now_s() > end_s

        await wait_for_first(self, Future(), measure)
        if found:
            return found[-1]
        if self._robot.world.newest_joints_s <= since_s:
            raise NoJointStateError(f"no joint positions {when}{self._robot.sensors.joint_advice}")
        if reasons:
            raise reasons[-1]
        raise self._robot.no_detection(since_s, when)

    # -- motions --------------------------------------------------------------------------------

    async def _execute(self, stretch: Stretch) -> None:
        first = stretch.waypoints[0]
        await self._require_at(stretch.start, f"before step {first.step}")
        await self._grip(first)
        if stretch.points:
            await self._robot.controllers.follow(stretch.points)

    async def _grip(self, waypoint: RecordedWaypoint) -> None:
        if waypoint.gripper.gap is None:
            return
        gap = await self._robot.move_fingers(waypoint.gripper.gap)
        if waypoint.gripper is GripperAction.CLOSE:
            waypoint.require_grasp(gap)

    async def _require_at(self, joints: tuple[float, ...], when: str) -> None:
        """Wait for new joint positions, which must be where the recording had the arm."""
        since_s = self._robot.clock.now_s()
        end_s = since_s + self._settings.joint_timeout
        await wait_for_first(
            self,
            Future(),
            lambda: (
                self._robot.world.newest_joints_s > since_s or self._robot.clock.now_s() > end_s
            ),
        )
        if self._robot.world.newest_joints_s <= since_s:
            raise NoJointStateError(
                f"no joint positions for {self._settings.joint_timeout} s {when}"
                f"{self._robot.sensors.joint_advice}"
            )
        off = self._robot.world.joint_distance(joints)
        if off > self._settings.arrival_tolerance:
            raise ControllerAbortedError(
                f"the arm is {off:.3f} rad off the recording {when}: it was held up, or moved"
            )


def stretches_of(recorded: RecordedMotion, dry_run: DryRun) -> tuple[Stretch, ...]:
    """The parts of a recording that are executed without a stop: each waypoint, or more of them."""
    if isinstance(dry_run, BlendedRun):
        return dry_run.stretches
    pairs = zip(recorded.waypoints, dry_run.motions, strict=True)
    return tuple(Stretch.of(waypoint, motion) for waypoint, motion in pairs)


def _held(state: State, name: str) -> bool:
    return bool(state.get(state.layout.object(name), "held") > 0.5)
