# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a domain on a robot in lock-step: one short motion per command, or per horizon of them.

On the ensemble's side it is what sim_node is. On the robot's side every command becomes a goal of a
joint trajectory controller, from rest to rest, after limits were checked here again; the gripper is
moved before it. The next state is measured once the arm stands and what it moved has come to rest.

It holds, which means that nothing is sent and that controllers stay where they are: between
commands; where a command is refused; and from the first failure of a controller or of the sensors
until ``slap/reset_task``: no state is published then, and ``slap/fault`` ends the skill under way.

ROS Parameters:
    domain (string, "obstacle_tower"): which domain; one with a Panda.
    preset (string, ""): one that obeys the joints' speed limit; empty: the domain's first.
    skills (string, ""), libraries (string, "runs/skills"): as sim_node's.
    seed (int, 0), index (int, 0), goal (string, ""): the task whose objects there are, unless a
        scene says so; the goal as sim_node's.
    scene (string, ""): a scene file; empty: the sampled task's objects, in frames detected_NAME.
    arm (string, "panda"): panda or fr3: limits, and the prefix of joints and frames.
    speed (double, 0.5): fraction of the arm's velocity and acceleration limits, above 0 to 1.
    workspace (double[6], [0.2, -0.5, 0.08, 0.8, 0.5, 0.9]): lowest and highest x, y, z of the
        fingertips in m, base frame.
    trajectory_action (string, "ARM_arm_controller/follow_joint_trajectory"),
    gripper_action (string, "franka_gripper/gripper_action"): names of the controllers' actions;
        ARM in them is replaced by the parameter arm.
    gripper_scale (double, 0.5): position to be sent per m between the fingers; Franka's action
        expects half the gap.
    gripper_effort (double, 20.0): N.
    position_noise (double, 0.002), turn_noise (double, 0.01): standard deviation of detections
        along each axis in m, about each axis in rad.
    hidden_after (int, 0): pictures in a row that show others but not an object, after which it is
        taken to be where it was at rest, and not to be there if none has shown it before a task
        begins; 0: never.
    settle_time (double, 1.5): s to wait for what moves to come to rest.
    joint_timeout (double, 0.5): s without joint positions after which the robot holds.
    detection_timeout (double, 2.0): s without a complete measurement after which it holds.
    controller_timeout (double, 0.5): s that a controller may take longer than it should.
    gripper_timeout (double, 5.0): s that the gripper may take.
    hold_after (double, 0.5): s without a command after which diagnostics report that it holds, and
        commands of an unfinished horizon are executed.
    horizon (int, 1): commands that the arm executes in one motion, without a stop between them, at
        most. The arm waits until it has them. The states between them are those of the domain's own
        world: only where nothing but the arm moves, with what it holds, and no atom changes.
    arrival_tolerance (double, 0.1): rad that a joint may be off after a motion.

Publishers:
    slap/domain (slap_msgs/DomainInfo), slap/task (slap_msgs/Task), slap/state
        (slap_msgs/ObjectCentricState), slap/fault (slap_msgs/EpisodeFault), slap/markers
        (visualization_msgs/MarkerArray): as sim_node.
    diagnostics (diagnostic_msgs/DiagnosticArray): phase, fault, counts; 1 Hz.

Subscribers:
    slap/command (slap_msgs/RobotCommand): refused unless it answers the current state and is safe.
    joint_states (sensor_msgs/JointState): of arm and fingers.
    tf, tf_static (tf2_msgs/TFMessage): detections, and where cameras are.
    slap/skills (slap_msgs/SkillLibrary): acquired skills, taken on with the next episode.

Services:
    slap/reset_task (slap_msgs/ResetTask): opens an episode in the state that is measured, whatever
        the seed; a robot cannot be put into a given one. Ends a fault. Refused until the
        controllers have answered to the last motion.

Action clients:
    trajectory_action (control_msgs/FollowJointTrajectory), gripper_action
        (control_msgs/GripperCommand).
"""

from __future__ import annotations

from enum import Enum
from typing import Any

from rclpy.task import Future
from slap_msgs.srv import ResetTask

from ensemble.entry_point import run_node
from ensemble.robot_parameters import RobotBridgeParameters
from ensemble.steady_time import create_timer
from robot_bridge.bridge import Bridge
from robot_bridge.robot import Robot
from robot_bridge.sole_bridge import require_alone
from robot_bridge.step_measurement import StepMeasurement
from slap_ros.core import Action, Task
from slap_ros.errors import (
    AlreadyRunningError,
    BusyError,
    ControllerAbortedError,
    InvalidStateError,
    NoDetectionError,
    NoJointStateError,
    SlapError,
)
from slap_ros.messages.decode import decode_goal
from slap_ros.relational import State
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.horizon import Horizon
from slap_ros.robot.joint_trajectory import TrajectoryPoint

POLL_PERIOD = 0.02  # s, between two looks at what is measured
# What keeps a task from being begun, as long as it lasts.
UNSTARTED = (AlreadyRunningError, InvalidStateError, NoDetectionError, NoJointStateError)
MOTIONLESS = 3  # motions in a row in which the arm stood, after which it is held to be stuck


class Phase(Enum):
    """What the bridge waits for; diagnostics have the name."""

    STARTING = "waiting for the robot and every object"
    READY = "waiting for a command"
    MOVING = "waiting for a controller"
    LOOKING = "measuring"
    FAULT = "holding after a failure"


class RobotBridge(Bridge[RobotBridgeParameters]):
    """The robot bridge."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("robot_bridge", RobotBridgeParameters, **kwargs)
        self._robot = Robot(self, self._domain, self._sampled_state, self._settings)
        self._robot_clock, self._sensors = self._robot.clock, self._robot.sensors
        self._enter(Phase.STARTING)
        self._motion: Future | None = None  # the newest: done when its controllers have answered
        self._measurement: StepMeasurement  # of the step under way
        self._stood = 0  # motions in a row in which the arm stood
        period_s = self._domain.execution.control_period_s
        self._horizon = Horizon(self._settings.horizon, self._settings.motion_limits, period_s)
        self._expected = False  # whether the state in which the motion ends is published already
        self._next: Action | None = None  # which answers that state, and waits for its measurement
        create_timer(self, POLL_PERIOD, self._poll)
        self._publish_domain()

    def destroy_node(self) -> None:
        """Hold, and release what the robot's clients use."""
        self._robot.destroy()
        super().destroy_node()

    def _sampled_state(self) -> State:
        return self._settings.first_task(self._domain).initial_state

    def _diagnostics(self) -> dict[str, object]:
        holding = self._phase is Phase.FAULT or (self._phase is Phase.READY and self._is_idle)
        return {
            **super()._diagnostics(),
            **self._sensors.counts,
            "phase": self._phase.name,
            "holding": holding,
        }

    def _occupation(self) -> str:
        moving = self._phase in (Phase.MOVING, Phase.LOOKING)
        waits = self._phase is Phase.READY or (moving and self._expected and self._next is None)
        return "" if waits else self._phase.value

    def _fail(self, error: SlapError) -> None:
        """Hold until reset."""
        self._forget_commands()
        self._robot.controllers.hold()
        self._enter(Phase.FAULT)
        super()._fail(error)

    # -- commands and steps ---------------------------------------------------------------------

    def _apply(self, action: Action) -> None:
        if self._phase is not Phase.READY:
            self._next = action
            return
        try:
            self._sensors.require_joints()
        except NoJointStateError as error:
            self._fail(error)
            return
        command = self._robot.world.plan_command(action)
        if self._horizon.commands and command.gripper is not GripperAction.KEEP:
            self._next = action  # fingers act only from a state that was measured
            self._move(expected=True)
            return
        self._horizon.add(command)
        state = self._robot.world.expect(command) if self._horizon.has_room else None
        if state is None:
            self._move(expected=False)
        else:
            self._since_s = self._robot_clock.now_s()
            self._publish_step(state)

    def _move(self, expected: bool) -> None:
        """Execute the commands that wait.

        Args:
            expected: Whether the state in which they end is published already.
        """
        self._expected = expected
        self._enter(Phase.MOVING)
        self._motion = self.executor.create_task(self._execute(*self._horizon.take()))

    async def _execute(self, gripper: GripperAction, points: tuple[TrajectoryPoint, ...]) -> None:
        try:
            await self._robot.actuate_gripper(gripper)
            start = self._robot.world.joints
            if self._phase is Phase.MOVING:  # not failed meanwhile
                await self._robot.controllers.follow(points)
        except SlapError as error:
            if self._phase is Phase.MOVING:
                self._fail(error)
        else:
            if self._phase is Phase.MOVING:
                self._enter(Phase.LOOKING)
                self._measurement = StepMeasurement(
                    self._robot, self._settings, self._since_s, start, points[-1].positions
                )

    def _poll(self) -> None:
        """Whatever time brings: a state, or a sensor that has become silent."""
        if self._phase is Phase.STARTING:
            if not (missing := self._robot.controllers.missing):
                self._start()
            elif self._has_waited:
                self._say_missing(missing, "arm, trajectory_action and gripper_action")
        elif self._phase is Phase.READY and self._horizon.commands and self._is_idle:
            self._move(expected=True)
        elif self._phase in (Phase.MOVING, Phase.LOOKING):
            try:
                self._sensors.require_joints(self._since_s)
                if self._phase is Phase.LOOKING:
                    self._measure()
            except SlapError as error:
                self._fail(error)

    def _measure(self) -> None:
        state = self._measurement.poll(self._robot_clock.now_s())
        if state is None:
            return
        self._require_motion()
        self._enter(Phase.READY)
        if not self._expected:
            self._publish_step(state)
        elif self._next is not None:
            action, self._next = self._next, None
            with self._refusing():
                self._apply(action)

    def _require_motion(self) -> None:
        """Refuse to go on with an arm that stands though its controller says that it has moved.

        Raises:
            ControllerAbortedError: It has stood several times in a row.
        """
        stood = self._measurement.stood
        if stood is not None:
            self._stood = self._stood + 1 if stood else 0
        if self._stood == MOTIONLESS:
            raise ControllerAbortedError(
                f"the arm has stood through {MOTIONLESS} motions that its controller calls done: "
                "are its brakes open, and does it execute what it accepts?"
            )

    def _forget_commands(self) -> None:
        """Execute none of the commands that wait."""
        self._horizon.commands.clear()
        self._next = None

    # -- episodes -------------------------------------------------------------------------------

    def _start(self) -> None:
        try:
            state = self._robot.world.measure_first(self._since_s)
            if state is not None:
                require_alone(self)
                self._begin(state)
            elif self._has_waited:
                raise self._unmeasured(self._since_s)
        except UNSTARTED as error:
            self._say_not_yet(error)

    def _reset(self, request: ResetTask.Request) -> None:
        self._require_arranged(request)
        if self._motion is not None and not self._motion.done():
            # Also after a failure: what is left of the motion would go on in the new episode.
            raise BusyError(
                "a motion is under way: cancel the task first, or try again once the controllers "
                "have answered"
            )
        world = self._robot.world
        state = world.measure_first(self._since_s)
        if state is None:
            raise self._unmeasured(self._since_s)
        space = self._domain.atom_space(world.scene_config.template)
        self._goal = decode_goal(request.goal, space)
        self._begin(state)

    def _no_detection(self, since_s: float) -> NoDetectionError:
        return self._robot.no_detection(since_s, f"within {self._settings.detection_timeout} s")

    def _begin(self, state: State) -> None:
        world = self._robot.world
        goal = frozenset(self._goal) or world.default_goal(state)
        world.require_seen(goal)
        if world.left_out:
            self.get_logger().warning(
                f"no picture shows {', '.join(world.left_out)}: the task is solved without; once "
                "it is seen, reset_task takes it in"
            )
        self._forget_commands()
        self._stood = 0
        self._enter(Phase.READY)
        self._open_episode(Task(state, goal, self._domain.step_limit))


def main() -> int:
    """Run the node."""
    return run_node("robot_bridge", RobotBridge)
