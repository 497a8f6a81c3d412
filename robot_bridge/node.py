# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a domain on a robot in lock-step: one short motion for one command.

On the ensemble's side it is what sim_node is. On the robot's side every command becomes a goal of a
joint trajectory controller, from rest to rest, after limits were checked here again; the gripper is
moved before it. The next state is measured once the arm stands and what it moved has come to rest.

It holds, which means that nothing is sent and that controllers stay where they are: between
commands; where a command is refused; and from the first failure of a controller or of the sensors
until ``slap/reset_task``, as no state is published then and skills give up for want of one.

ROS Parameters:
    domain (string, "obstacle_tower"): which domain; one with a Panda.
    preset (string, "fair"): one that obeys the joints' speed limit.
    seed (int, 0), index (int, 0): the task whose objects there are, unless a scene says so.
    scene (string, ""): a scene file; empty: the sampled task's objects, in frames detected_NAME.
    arm (string, "panda"): panda or fr3: limits, and the prefix of joints and frames.
    speed (double, 0.5): fraction of the arm's velocity and acceleration limits, above 0 to 1.
    workspace (double[6]): lowest and highest x, y, z of the fingertips in m, base frame.
    trajectory_action, gripper_action (string): names of the controllers' actions; ARM in them is
        the arm's.
    gripper_scale (double, 0.5): position to be sent for each m between the fingers; Franka's
        action wants half the gap.
    gripper_effort (double, 20.0): N.
    position_noise (double, 0.002), turn_noise (double, 0.01): of detections, m and rad.
    settle_time (double, 1.5): s to wait for what moves to come to rest.
    joint_timeout (double, 0.5): s without joint positions after which the robot holds.
    detection_timeout (double, 2.0): s without a complete measurement after which it holds.
    controller_timeout (double, 0.5): s that a controller may take longer than it should.
    gripper_timeout (double, 5.0): s that the gripper may take.
    hold_after (double, 0.5): s without a command after which it says that it holds.
    arrival_tolerance (double, 0.1): rad that a joint may be off after a motion.

Publishers:
    slap/domain (slap_msgs/DomainInfo), slap/task (slap_msgs/Task), slap/state
        (slap_msgs/ObjectCentricState), slap/markers (visualization_msgs/MarkerArray): as sim_node.
    diagnostics (diagnostic_msgs/DiagnosticArray): phase, fault, counts; 1 Hz.

Subscribers:
    slap/command (slap_msgs/RobotCommand): refused unless it answers the current state and is safe.
    joint_states (sensor_msgs/JointState): of arm and fingers.
    tf, tf_static (tf2_msgs/TFMessage): detections, and where cameras are.

Services:
    slap/reset_task (slap_msgs/ResetTask): opens an episode in the state that is measured, whatever
        the seed; a robot cannot be put into a given one. Ends a fault.

Action clients:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node
from slap_msgs.msg import RobotCommand
from slap_msgs.srv import ResetTask

from ensemble import encode
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import node_time_s
from ensemble.interfaces import COMMAND, DOMAIN, MARKERS, RESET_TASK, STATE, TASK, VOLATILE
from ensemble.parameters import parameter, read_parameters
from ensemble.robot_parameters import RobotParameters
from ensemble.visualization import markers
from robot_bridge.robot import Robot
from slap_ros.core import Task
from slap_ros.domains import get_domain
from slap_ros.errors import (
    BusyError,
    ControllerAbortedError,
    ErrorCode,
    InvalidCommandError,
    InvalidStateError,
    NoDetectionError,
    NoJointStateError,
    SlapError,
    StaleCommandError,
    UnsafeCommandError,
)
from slap_ros.messages.decode import decode_command, decode_goal
from slap_ros.relational import GroundAtom, State
from slap_ros.robot.robot_world import GAP_OPEN, GAP_SHUT, GripperAction, SafeCommand

MEASURED = -1  # seed of a task that was not sampled
LOOK_PERIOD = 0.02  # s, between two looks at what is measured


@dataclass(frozen=True)
class RobotBridgeParameters(RobotParameters):
    """See the module's docstring."""

    domain: str = parameter("obstacle_tower", "which domain")
    preset: str = parameter("fair", "one that obeys the joints' speed limit")
    seed: int = parameter(0, "samples the task whose objects there are")
    index: int = parameter(0, "which of the seed's tasks")
    settle_time: float = parameter(1.5, "s to wait for what moves to come to rest")
    detection_timeout: float = parameter(2.0, "s without a measured state until the robot holds")
    hold_after: float = parameter(0.5, "s without a command after which it says that it holds")


class Phase(Enum):
    """What the bridge waits for."""

    STARTING = "waiting for the robot and every object"
    READY = "waiting for a command"
    MOVING = "waiting for a controller"
    LOOKING = "measuring"
    FAULT = "holding after a failure"


class RobotBridge(Node):
    """The robot bridge."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("robot_bridge", **kwargs)
        self._settings = settings = read_parameters(self, RobotBridgeParameters)
        self._domain = get_domain(settings.domain, settings.preset)
        self._robot = Robot(self, self._domain, self._sampled, settings)
        self._phase = Phase.STARTING
        self._since_s = node_time_s(self)  # when the phase, or the measurement of a state, began
        self._fault = ErrorCode.NONE
        self._goal: Collection[GroundAtom] = ()
        self._last: SafeCommand | None = None
        self._episode = 0
        self._step = 0
        self._counts: Counter[str] = Counter(
            steps=0, stale_commands=0, invalid_commands=0, unsafe_commands=0, faults=0
        )
        self._domains = self.create_publisher(DOMAIN.type, DOMAIN.name, DOMAIN.qos)
        self._tasks = self.create_publisher(TASK.type, TASK.name, TASK.qos)
        self._states = self.create_publisher(STATE.type, STATE.name, STATE.qos)
        self._markers = self.create_publisher(MARKERS.type, MARKERS.name, MARKERS.qos)
        # Fresh: commands from before this node started belong to another world's states.
        self.create_subscription(COMMAND.type, COMMAND.name, self._on_command, VOLATILE)
        self.create_service(RESET_TASK.type, RESET_TASK.name, self._on_reset)
        self.create_timer(LOOK_PERIOD, self._look)
        DiagnosticsPublisher(self, self._diagnostics)
        self._domains.publish(encode.domain_info(self._domain, self._now()))

    def destroy_node(self) -> None:
        """Hold, and give back what is held."""
        self._robot.destroy()
        super().destroy_node()

    def _sampled(self) -> State:
        return self._domain.task(self._settings.seed, self._settings.index).initial_state

    def _now(self) -> Time:
        return self.get_clock().now().to_msg()

    def _diagnostics(self) -> dict[str, object]:
        idle = node_time_s(self) - self._since_s > self._settings.hold_after
        holding = self._phase is Phase.FAULT or (self._phase is Phase.READY and idle)
        return {
            **self._counts,
            **self._robot.sensors.counts,
            "episode": self._episode,
            "phase": self._phase.name,
            "fault": self._fault.name,
            "holding": holding,
        }

    # -- commands -------------------------------------------------------------------------------

    def _on_command(self, message: RobotCommand) -> None:
        try:
            self._check_moment(message)
            self._require_joints()
            step = self._robot.world.plan_command(decode_command(message))
        except NoJointStateError as error:
            self._fail(error)
        except StaleCommandError as error:
            self._refuse("stale_commands", error)
        except InvalidCommandError as error:
            self._refuse("invalid_commands", error)
        except UnsafeCommandError as error:
            self._refuse("unsafe_commands", error)
        else:
            self._enter(Phase.MOVING)
            self.executor.create_task(self._act(step))

    def _check_moment(self, message: RobotCommand) -> None:
        answered = self._phase is not Phase.READY
        if answered or (message.episode, message.step) != (self._episode, self._step):
            raise StaleCommandError(
                f"command for episode {message.episode}, step {message.step} refused: "
                f"the robot is at episode {self._episode}, step {self._step}, "
                f"{self._phase.value}"
            )

    def _require_joints(self) -> None:
        silence = node_time_s(self) - self._robot.world.newest_joints_s
        if silence > self._settings.joint_timeout:
            raise NoJointStateError(f"no joint positions for {silence:.1f} s")

    def _refuse(self, kind: str, error: SlapError) -> None:
        self._counts[kind] += 1
        self.get_logger().warning(f"{error} ({self._counts[kind]} {kind.replace('_', ' ')})")

    async def _act(self, step: SafeCommand) -> None:
        try:
            await self._grip(step.gripper)
            if self._phase is Phase.MOVING:  # not failed meanwhile
                await self._robot.controllers.move(step.motion)
        except SlapError as error:
            if self._phase is Phase.MOVING:
                self._fail(error)
        else:
            if self._phase is Phase.MOVING:
                self._last = step
                self._enter(Phase.LOOKING)

    async def _grip(self, gripper: GripperAction) -> None:
        if gripper is GripperAction.CLOSE and self._robot.world.confirm_grasp(
            await self._fingers(GAP_SHUT)
        ):
            return
        if gripper is not GripperAction.KEEP:  # to be opened, or closed around nothing
            await self._fingers(GAP_OPEN)
            self._robot.world.confirm_release()

    async def _fingers(self, gap: float) -> float:
        """Move the fingers; the gap in m at which they then stand."""
        return await self._robot.move_fingers(gap)

    # -- measuring ------------------------------------------------------------------------------

    def _look(self) -> None:
        """Whatever time brings: a state, or a sensor that has become silent."""
        now_s = node_time_s(self)
        if self._phase in (Phase.STARTING, Phase.FAULT):
            if self._phase is Phase.STARTING and self._robot.controllers.ready:
                self._start()
        elif self._phase is Phase.READY:
            pass  # it stands, whatever the sensors say
        elif (
            now_s - max(self._robot.world.newest_joints_s, self._since_s)
            > self._settings.joint_timeout
        ):
            self._fail(NoJointStateError(f"no joint positions: {self._phase.value}"))
        elif self._phase is Phase.LOOKING:
            self._measure(now_s)

    def _start(self) -> None:
        try:
            state = self._robot.world.measure(self._since_s)
        except InvalidStateError as error:
            self.get_logger().warning(f"not yet: {error}", throttle_duration_sec=1.0)
            return
        if state is not None:
            self._open_episode(state)

    def _measure(self, now_s: float) -> None:
        waited = now_s - self._since_s
        try:
            state = self._robot.world.measure(
                self._since_s, moving=waited > self._settings.settle_time
            )
            if state is not None:
                self._require_arrival()
        except InvalidStateError as error:
            if waited > self._settings.detection_timeout:
                self._fail(error)
        except ControllerAbortedError as error:
            self._fail(error)
        else:
            if state is not None:
                self._advance(state)
            elif waited > self._settings.detection_timeout:
                self._fail(self._blind())

    def _blind(self) -> NoDetectionError:
        missing = (
            ", ".join(self._robot.world.undetected(self._since_s))
            or "none at all, but too few times"
        )
        return NoDetectionError(
            f"not detected within {self._settings.detection_timeout} s: {missing}"
        )

    def _require_arrival(self) -> None:
        off = (
            0.0
            if self._last is None
            else self._robot.world.joint_distance(self._last.motion.target)
        )
        if off > self._settings.arrival_tolerance:
            raise ControllerAbortedError(
                f"the arm is {off:.3f} rad off where its controller says that it went"
            )

    def _advance(self, state: State) -> None:
        self._step += 1
        self._counts["steps"] += 1
        self._enter(Phase.READY)
        now = self._now()
        self._states.publish(encode.state(state, self._episode, self._step, now))
        self._show(state, now)

    def _enter(self, phase: Phase) -> None:
        self._phase = phase
        self._since_s = node_time_s(self)

    def _fail(self, error: SlapError) -> None:
        """Hold until reset."""
        self._robot.controllers.hold()
        self._enter(Phase.FAULT)
        self._fault = error.code
        self._counts["faults"] += 1
        self.get_logger().error(f"{error.code.name}: {error}; the robot holds until reset_task")

    # -- episodes -------------------------------------------------------------------------------

    def _open_episode(self, state: State) -> None:
        task = Task(
            state,
            frozenset(self._goal) or self._domain.default_goal(state),
            self._domain.step_limit,
        )
        self._episode += 1
        self._step = 0
        self._fault = ErrorCode.NONE
        self._last = None
        self._enter(Phase.READY)
        now = self._now()
        message = encode.task(task, self._domain, self._episode, MEASURED, 0, now)
        self._tasks.publish(message)
        self._states.publish(message.initial_state)
        self._show(state, now)
        self.get_logger().info(f"episode {self._episode}: {self._domain.name}, as measured")

    def _show(self, state: State, stamp: Time) -> None:
        # Not as frames or joint states: those are the robot's own to publish.
        self._markers.publish(markers(self._domain.display.bodies(state), stamp))

    def _on_reset(
        self, request: ResetTask.Request, response: ResetTask.Response
    ) -> ResetTask.Response:
        try:
            self._reset(request)
        except SlapError as error:
            response.error_code, response.error_msg = int(error.code), str(error)
        else:
            response.error_code = int(ErrorCode.NONE)
        response.episode = self._episode
        return response

    def _reset(self, request: ResetTask.Request) -> None:
        if request.initial_state.objects:
            raise InvalidStateError(
                "a robot cannot be put into a state: arrange the objects, then reset without one"
            )
        if self._phase is Phase.MOVING:
            raise BusyError("the arm moves: cancel the task first")
        state = self._robot.world.measure(self._since_s)
        if state is None:
            self._require_joints()
            raise self._blind()
        self._goal = decode_goal(request.goal, self._domain.atom_space(state))
        self._open_episode(state)


def main() -> int:
    """Run the node."""
    return run_node("robot_bridge", RobotBridge)
