# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo behind the core of the bridge, in one process and without ROS.

Time is the plant's: commands become safe motions, the controllers follow them, and what is
measured becomes a state, by the same code as in ``robot_bridge``. A state is what a robot can
measure, so a step is not a function of it: use it to execute plans, not to plan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from slap_ros.core import Action, Domain
from slap_ros.errors import InvalidStateError, NoDetectionError
from slap_ros.relational import GroundAtom, State
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import PANDA, Limits
from slap_ros.robot.measured_world import MeasuredWorld
from slap_ros.robot.mujoco.arm import FINGER_FORCE, PERIOD_S
from slap_ros.robot.mujoco.detectors import ExactDetector, ObjectDetector
from slap_ros.robot.mujoco.plant_controllers import REACH, TOLERANCES, PlantControllers
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.robot.trajectory_tracking import TrajectoryTolerances


@dataclass(frozen=True)
class ClosedLoopSettings:
    """Settings of bridge, controllers and detections: the defaults of the nodes.

    Args:
        limits: Limits of the arm.
        tracking: How far detections can be trusted.
        tolerances: Tolerances of the arm's controller.
        finger_force: Largest force of each finger, N.
        settle_time_s: Time to wait for what moves to come to rest, s.
        detection_timeout_s: Time without a state after which a step fails, s.
    """

    limits: Limits = field(default_factory=lambda: PANDA.scaled(0.5, REACH))
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    tolerances: TrajectoryTolerances = TOLERANCES
    finger_force: float = FINGER_FORCE
    settle_time_s: float = 1.5
    detection_timeout_s: float = 2.0


def camera_settings() -> ClosedLoopSettings:
    """Settings behind a camera, whose pictures come seldom, and from which an arm hides blocks."""
    tracking = TrackingSettings(hidden_after=5)
    return ClosedLoopSettings(tracking=tracking, settle_time_s=4.0, detection_timeout_s=8.0)


class ClosedLoopWorld(MeasuredWorld):
    """A world whose states are measured once everything has come to rest.

    Args:
        domain: Domain with a Panda.
        initial: State of a task, in which the plant begins.
        settings: Settings of the loop.
        detector: What tells where objects are, with the plant; without one, poses are exact.

    Raises:
        SlapError: MuJoCo cannot express the scene, or it cannot be measured.
    """

    def __init__(
        self,
        domain: Domain,
        initial: State,
        settings: ClosedLoopSettings | None = None,
        detector: ObjectDetector | None = None,
    ) -> None:
        settings = settings or ClosedLoopSettings()
        self._settings = settings
        self._detector = detector or ExactDetector(domain, initial)
        self.plant = self._detector.plant
        self._robot = RobotWorld(domain, self._detector.config, settings.limits, settings.tracking)
        self._controllers = PlantControllers(
            self.plant, settings.tolerances, settings.finger_force, self._watch
        )
        self._detected_s = self.plant.time_s
        self._state = self._measured(self.plant.time_s, self._robot.measure_first)

    def step(self, action: Action) -> State:
        """Act, wait until everything is at rest, and measure.

        Raises:
            SlapError: The command is unsafe, a controller gave up, or nothing can be measured.
        """
        command = self._robot.plan_command(action)
        self._actuate(command.gripper)
        self._controllers.move(command.motion)
        self._state = self._measured(self.plant.time_s, self._robot.measure)
        return self._state

    def require_seen(self, goal: Iterable[GroundAtom]) -> None:
        """Refuse a goal about what no picture showed when the task began.

        Raises:
            NoDetectionError: It is about such an object.
        """
        self._robot.require_seen(goal)

    def close(self) -> None:
        """Release what the core of the bridge and the detector use."""
        self._robot.close()
        self._detector.close()

    def _actuate(self, action: GripperAction) -> None:
        """As the bridge does: what closes around nothing is opened again."""
        if action.gap is None:
            return
        self._controllers.move_fingers(action.gap)
        if action is GripperAction.OPEN:
            self._robot.confirm_release()
        elif not self._robot.confirm_grasp(self.plant.gap):
            self._actuate(GripperAction.OPEN)

    def _measured(self, since_s: float, measure: Callable[[float, bool], State | None]) -> State:
        """The state since a time, s, once it is known."""
        settings, invalid = self._settings, ""
        while (waited := self.plant.time_s - since_s) <= settings.detection_timeout_s:
            if self._pass_period():
                try:
                    state = measure(since_s, waited > settings.settle_time_s)
                except InvalidStateError as error:
                    invalid = str(error)
                    continue
                if state is not None:
                    return state
        if invalid:
            raise InvalidStateError(invalid)
        raise NoDetectionError(f"not detected: {self._robot.what_is_missing(since_s)}")

    def _pass_period(self) -> bool:
        """Let a period pass; whether something was measured at its end."""
        before_s = self._detected_s
        self._controllers.pass_period()
        return self._detected_s > before_s

    def _watch(self) -> None:
        """Measure joints and objects as often as the detector does."""
        plant = self.plant
        if plant.time_s - self._detected_s < self._detector.period_s - 0.5 * PERIOD_S:
            return
        self._detected_s = now_s = plant.time_s
        self._robot.add_joint_reading(
            JointReading(now_s, tuple(plant.joints), tuple(plant.joint_velocities), plant.gap)
        )
        if not self._controllers.arm_moves:  # what is detected on the way counts for nothing
            self._look(now_s)

    def _look(self, now_s: float) -> None:
        detected = self._detector.detect()
        if detected is None:
            return
        for found in detected:
            self._robot.add_detection(found.frame, now_s, found.base, found.seen)
        self._robot.add_picture(now_s)
