# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a domain of the contact world on a robot: a command per control period, while it moves.

In place of robot_bridge, whose arm stands when a state is measured. Here a command is a short
trajectory that replaces the one before, and the next state is measured when the control period is
over, wherever the arm is by then. The gripper is told to move and not waited for.

Without a command the arm ends its trajectory, which takes a control period, and holds. It holds as
well from the first failure of the sensors until ``slap/reset_task``.

ROS Parameters:
    domain (string, "stack_at_target"): which domain; one of the contact world.
    preset (string, ""), skills (string, ""), libraries (string, "runs/skills"): as sim_node's.
    seed (int, 0), index (int, 0), goal (string, ""): the task whose objects there are, unless a
        scene says so; the goal as sim_node's.
    scene (string, ""): a scene file; empty: the sampled task's objects, in frames detected_NAME.
        Of a drawer or a lid, the part that opens is detected, as detected_NAME_moving; the rest
        stands where the task has it.
    arm (string, "panda"): prefix of joints and frames.
    workspace (double[6], [0.2, -0.5, 0.0, 0.8, 0.5, 0.9]): lowest and highest x, y, z of the
        fingertips in m, base frame.
    trajectory_topic (string, "ARM_arm_controller/joint_trajectory"): topic of the arm's controller;
        ARM in it is replaced by the parameter arm.
    gripper_action (string, "franka_gripper/gripper_action"), gripper_scale (double, 0.5),
        gripper_effort (double, 20.0): as robot_bridge's.
    position_noise (double, 0.0005), turn_noise (double, 0.005): standard deviation of detections
        along each axis in m, about each axis in rad. What moves by less counts as at rest.
    hidden_after (int, 0): pictures in a row that do not show an object, after which it is where it
        was, or where the hand has it or let it go; 0: never.
    joint_timeout (double, 0.5): s without joint positions after which the robot holds.
    detection_timeout (double, 2.0): s without a complete measurement after which it holds.
    hold_after (double, 0.5): s without a command after which diagnostics report that it holds.
    pace (double, 1.0): how many times faster than a real robot's its time passes.

Publishers:
    slap/domain (slap_msgs/DomainInfo), slap/task (slap_msgs/Task), slap/state
        (slap_msgs/ObjectCentricState), slap/fault (slap_msgs/EpisodeFault), slap/markers
        (visualization_msgs/MarkerArray): as sim_node.
    trajectory_topic (trajectory_msgs/JointTrajectory): two points, from where the joints were told
        to be to where they are to be a control period later.
    diagnostics (diagnostic_msgs/DiagnosticArray): phase, fault, counts, and the objects that the
        last pictures do not show; 1 Hz.

Subscribers:
    slap/command (slap_msgs/RobotCommand): refused unless it answers the current state and is safe.
    joint_states (sensor_msgs/JointState): of arm and fingers.
    tf, tf_static (tf2_msgs/TFMessage): detections, and where cameras are.
    slap/skills (slap_msgs/SkillLibrary): acquired skills, taken on with the next episode.

Services:
    slap/reset_task (slap_msgs/ResetTask): opens an episode in the state that is measured, whatever
        the seed. Ends a fault.

Action clients:
    gripper_action (control_msgs/GripperCommand).
"""

from __future__ import annotations

from enum import Enum
from typing import Any

from slap_msgs.srv import ResetTask

from ensemble.entry_point import run_node
from ensemble.robot_parameters import ServoBridgeParameters, action_name, arm_joints
from ensemble.steady_time import JumpFreeClock, create_timer
from robot_bridge.bridge import Bridge
from robot_bridge.sensors import Sensors
from robot_bridge.servo.controllers import ServoControllers
from robot_bridge.sole_bridge import require_alone
from slap_ros.core import Action, Task
from slap_ros.errors import (
    AlreadyRunningError,
    BusyError,
    InvalidStateError,
    NoDetectionError,
    NoJointStateError,
    SlapError,
)
from slap_ros.messages.decode import decode_goal
from slap_ros.relational import State
from slap_ros.robot.scene_config import chosen_scene_config
from slap_ros.robot.servoed_robot import ServoedRobot

POLL_PERIOD = 0.005  # s, between two looks at what is measured
# What keeps a task from being begun, as long as it lasts.
UNSTARTED = (
    AlreadyRunningError,
    BusyError,
    InvalidStateError,
    NoDetectionError,
    NoJointStateError,
)


class ServoPhase(Enum):
    """What the bridge waits for; diagnostics have the name."""

    STARTING = "waiting for the robot and every object"
    READY = "waiting for a command"
    MOVING = "waiting for the control period to end"
    FAULT = "holding after a failure"


class ServoBridge(Bridge[ServoBridgeParameters]):
    """The bridge to a robot at a bench."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("servo_bridge", ServoBridgeParameters, **kwargs)
        settings = self._settings
        scene_config = chosen_scene_config(
            settings.scene,
            self._domain,
            lambda: settings.first_task(self._domain).initial_state,
        )
        self._robot = ServoedRobot(
            self._domain,
            scene_config,
            settings.space,
            settings.tracking,
            settings.pace,
        )
        self._robot_clock = JumpFreeClock(self)
        self._sensors = Sensors(self, self._robot, settings, self._robot_clock)
        self._controllers = ServoControllers(
            self,
            action_name(settings.trajectory_topic, settings.arm),
            action_name(settings.gripper_action, settings.arm),
            arm_joints(settings.arm),
            self._fail,
        )
        self._period_s = self._domain.execution.control_period_s / settings.pace
        self._enter(ServoPhase.STARTING)
        create_timer(self, POLL_PERIOD, self._poll)
        self._publish_domain()

    def destroy_node(self) -> None:
        """Release what clients and model use; the arm holds where its last trajectory ends."""
        self._controllers.destroy()
        self._robot.close()
        super().destroy_node()

    def _diagnostics(self) -> dict[str, object]:
        ready = self._phase is ServoPhase.READY
        holding = self._phase is ServoPhase.FAULT or (ready and self._is_idle)
        counts = {**super()._diagnostics(), **self._sensors.counts}
        hidden = ", ".join(self._robot.hidden)
        return {**counts, "phase": self._phase.name, "holding": holding, "hidden": hidden}

    def _occupation(self) -> str:
        return "" if self._phase is ServoPhase.READY else self._phase.value

    def _fail(self, error: SlapError) -> None:
        """Hold until reset: no trajectory follows the last one."""
        self._enter(ServoPhase.FAULT)
        super()._fail(error)

    # -- commands and steps ---------------------------------------------------------------------

    def _apply(self, action: Action) -> None:
        try:
            self._sensors.require_joints()
        except NoJointStateError as error:
            self._fail(error)
            return
        command = self._robot.plan_command(action)
        self._enter(ServoPhase.MOVING)
        if (gap := command.gripper.gap) is not None:
            settings = self._settings
            self._controllers.move_gripper(gap * settings.gripper_scale, settings.gripper_effort)
        self._controllers.follow(command.points)

    def _poll(self) -> None:
        """Whatever time brings: a state, or a sensor that has become silent."""
        if self._phase is ServoPhase.STARTING:
            if not (missing := self._controllers.missing):
                self._start()
            elif self._has_waited:
                self._say_missing(missing, "arm, trajectory_topic and gripper_action")
        elif self._phase is ServoPhase.MOVING:
            over_s = self._since_s + self._period_s
            if self._robot_clock.now_s() >= over_s:
                self._measure(over_s)

    def _measure(self, over_s: float) -> None:
        """Publish the state of a period that is over, once there are joint positions since."""
        late = self._robot_clock.now_s() - over_s > self._settings.detection_timeout
        try:
            self._sensors.require_joints(over_s)
            state = self._robot.measure(over_s)
            if state is None and late:
                raise self._unmeasured(over_s)
        except InvalidStateError as error:  # better measurements may follow
            if late:
                self._fail(error)
        except SlapError as error:
            self._fail(error)
        else:
            self._require_detections()
            if state is not None and self._phase is ServoPhase.MOVING:
                self._enter(ServoPhase.READY)
                self._publish_step(state)

    def _require_detections(self) -> None:
        """Hold where an object was not detected for too long."""
        since_s = self._robot_clock.now_s() - self._settings.detection_timeout
        if self._robot.undetected(since_s):
            self._fail(self._unmeasured(since_s))

    def _no_detection(self, since_s: float) -> NoDetectionError:
        missing = ", ".join(self._robot.undetected(since_s)) or "too few times: some object"
        covered = ", ".join(self._robot.never_shown)
        advice = f"; others are seen: move what is in front of {covered}, or the camera"
        return NoDetectionError(
            f"not detected within {self._settings.detection_timeout} s: {missing}"
            + (advice if covered else "")
        )

    # -- episodes -------------------------------------------------------------------------------

    def _start(self) -> None:
        try:
            state = self._measured_first()
            require_alone(self)
            self._begin(state)
        except UNSTARTED as error:
            if self._has_waited:
                self._say_not_yet(error)

    def _measured_first(self) -> State:
        """The state in which an episode begins.

        Raises:
            SlapError: There is none: the arm moves, or something is not measured or cannot be.
        """
        if self._robot.arm_moves:
            raise BusyError("the arm moves: cancel the task first, or try again once it stands")
        since_s = self._robot_clock.now_s() - self._settings.detection_timeout
        state = self._robot.begin(since_s)
        if state is None:
            raise self._unmeasured(since_s)
        return state

    def _reset(self, request: ResetTask.Request) -> None:
        self._require_arranged(request)
        state = self._measured_first()
        self._goal = decode_goal(request.goal, self._domain.atom_space(state))
        self._begin(state)

    def _begin(self, state: State) -> None:
        goal = frozenset(self._goal) or self._domain.default_goal(state)
        self._enter(ServoPhase.READY)
        self._open_episode(Task(state, goal, self._domain.step_limit))


def main() -> int:
    """Run the node."""
    return run_node("servo_bridge", ServoBridge)
