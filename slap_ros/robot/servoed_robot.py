# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot at a bench that is commanded while it moves, as far as encoders and detections say.

A state of the contact world has velocities, what is held, and where the hand was told to be. The
joints give the hand's velocity, detections say how things lie or move (``bench_objects``), and what
was told is known.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

from slap_ros.core import Action, Domain
from slap_ros.errors import (
    InvalidParameterError,
    InvalidSceneError,
    InvalidStateError,
)
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.robot.bench_objects import BenchObjects
from slap_ros.robot.joint_history import JointHistory
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import Workspace
from slap_ros.robot.scene_config import SceneConfig
from slap_ros.robot.servoing import HandServo, ServoCommand
from slap_ros.robot.state_assembly import possible_joints
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex, ContactSnapshot
from slap_ros.worlds.contact.validation import require_possible_bodies
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.panda import FINGER_OPEN, grasp_pose

STOPPED = 0.005  # m, from its end, of a finger that was told to close


def is_servoed(domain: Domain) -> bool:
    """Whether a robot is commanded while it moves in a domain: whether its hand acts by forces."""
    return ROBOT in domain.types


def require_servoed(domain: Domain, scene_config: SceneConfig) -> None:
    """Refuse what a robot that is commanded while it moves cannot do, before anything is started.

    Args:
        domain: Domain whose hand acts by forces.
        scene_config: Objects of the scene, and how they are detected.

    Raises:
        InvalidParameterError: Its world is disturbed on purpose.
        InvalidSceneError: Something that moves is not detected.
    """
    if domain.make_model is not None:
        raise InvalidParameterError(
            f"{domain} has disturbances of its own, which only a simulation can have; use another "
            "preset, or --world sim"
        )
    _contact_model(domain, scene_config).close()


def _contact_model(domain: Domain, scene_config: SceneConfig) -> ContactWorld:
    """The planner's world, where everything that moves is detected.

    Raises:
        InvalidSceneError: Something that moves is not detected, or something else is.
    """
    model = domain.make_world(scene_config.template)
    assert isinstance(model, ContactWorld)
    try:
        _require_detected(model.scene, scene_config)
    except InvalidSceneError:
        model.close()
        raise
    return model


def _require_detected(scene: ContactScene, scene_config: SceneConfig) -> None:
    """Refuse a scene unless that is detected which moves, and nothing else."""
    detected = {obj.name for obj in scene_config.detected}
    moving = {body.name: "where it is" for body in scene.free}
    moving |= {body.name: "how far it is open" for body in scene.jointed}
    for name in sorted(moving.keys() - detected):
        raise InvalidSceneError(
            f"{name} needs a frame in which it is detected: nothing else measures {moving[name]}"
        )
    for name in sorted(detected - moving.keys()):
        raise InvalidSceneError(f"{name} does not move: it needs a pose, and not a frame")


class ServoedRobot:
    """A robot and the objects at its bench.

    Args:
        domain: Domain of the contact world.
        scene_config: Objects of the scene, and how they are detected.
        workspace: Space in which the fingertips may be told to be.
        tracking: Settings of how far detections can be trusted.
        pace: How many times faster than a real robot's its time passes.

    Raises:
        InvalidParameterError: The domain has another robot.
        InvalidSceneError: Something that moves is not detected.
    """

    def __init__(
        self,
        domain: Domain,
        scene_config: SceneConfig,
        workspace: Workspace,
        tracking: TrackingSettings,
        pace: float = 1.0,
    ) -> None:
        if not is_servoed(domain):
            raise InvalidParameterError(f"{domain.name} has no hand that acts by forces")
        self.domain, self._workspace, self._pace = domain, workspace, pace
        self._template = scene_config.template
        self._model = _contact_model(domain, scene_config)
        scene = self._model.scene
        self._index = ContactIndex.of(scene, self._template.layout)
        self._placement = self._index.placement(scene, self._template)
        self._history = JointHistory()
        self._objects = BenchObjects(scene_config, scene, self._placement, tracking, self._history)
        self._servo: HandServo | None = None
        self._state: State | None = None  # measured last

    # -- measurements ---------------------------------------------------------------------------

    def add_detection(self, frame: str, stamp_s: float, base: Pose, seen: Pose) -> None:
        """Take a detection; see :meth:`DetectedObjects.add`.

        Args:
            frame: Name of the child frame.
            stamp_s: Time of the measurement, s.
            base: Pose of the parent frame in the base's frame.
            seen: Pose of the child frame in its parent.

        Raises:
            InvalidMeasurementError: It cannot be, as beside the way of a drawer, or is not newer
                than the last one.
        """
        self._objects.detected.add(frame, stamp_s * self._pace, base, seen)

    def add_picture(self, stamp_s: float) -> None:
        """Take that a picture was searched: what none of several shows is hidden.

        Args:
            stamp_s: Time at which it was taken, s.
        """
        self._objects.detected.add_picture(stamp_s * self._pace)

    def add_joint_reading(self, reading: JointReading) -> None:
        """Take joint positions.

        Raises:
            InvalidMeasurementError: They are older than the last ones.
        """
        self._history.add(replace(reading, stamp_s=reading.stamp_s * self._pace))

    @property
    def newest_joints_s(self) -> float:
        """Stamp of the newest joint positions; minus infinity without any."""
        return self._history.newest_s / self._pace

    @property
    def arm_moves(self) -> bool:
        """Whether the arm moved when its joints were measured last."""
        return self._history.arm_moves

    def undetected(self, since_s: float) -> list[str]:
        """Names of the objects that were not detected since a time, s, without those hidden since.

        Where detections of one come and are refused, its name is followed by the reason.
        """
        return self._objects.undetected(since_s * self._pace)

    @property
    def hidden(self) -> list[str]:
        """Names of the objects that the last pictures do not show."""
        return self._objects.hidden

    @property
    def never_shown(self) -> list[str]:
        """Names of the objects that no picture has ever shown, where pictures show others."""
        return self._objects.never_shown

    # -- states ---------------------------------------------------------------------------------

    def begin(self, since_s: float) -> State | None:
        """The state in which a task begins: the arm stands where it was told to be.

        Args:
            since_s: Time since which everything is to be measured, s.

        Returns:
            The state; None while something is not measured yet, or the arm moves.

        Raises:
            InvalidStateError: What is measured cannot be.
        """
        if self.undetected(since_s) or not self._history or self.arm_moves:
            return None
        newest = self._history.newest
        closing = newest.gap is not None and 0.5 * newest.gap < FINGER_OPEN - STOPPED
        stay = HandCommand.to_stay(grasp_pose(possible_joints(newest.joints)), closing)
        state = self._assembled(since_s, stay)
        if state is not None:
            self._model.reset(self.domain.execution.clear(state))  # plans begin here
            self._servo = HandServo(self._index, state, self._workspace)
        return state

    def measure(self, since_s: float) -> State | None:
        """The state now.

        Args:
            since_s: Time since which joints are to be measured, s.

        Returns:
            The state; None while measurements are missing, or no task has begun.

        Raises:
            InvalidStateError: What is measured cannot be.
        """
        return None if self._servo is None else self._assembled(since_s, self._servo.command)

    def _assembled(self, since_s: float, told: HandCommand) -> State | None:
        if self.newest_joints_s <= since_s or len(self._history) < 2:
            return None
        hand, joints = self._history.measured_hand(told)
        bench = self._objects.measure(hand)
        if bench is None:
            return None
        snapshot = ContactSnapshot(joints, hand, bench.bodies, bench.openings, bench.held)
        state = self._index.write(self._template, snapshot)
        state.require_finite()
        require_possible_bodies(self._model.scene, snapshot, self._placement, self.hidden)
        self._state = state
        return state

    # -- commands -------------------------------------------------------------------------------

    def plan_command(self, action: Action) -> ServoCommand:
        """The command of an action, from where the hand is now.

        Args:
            action: Action of the contact world.

        Raises:
            InvalidCommandError: The action is not in the action space.
            UnsafeCommandError: The fingertips would leave the workspace.
            InvalidStateError: No task has begun.
        """
        with suppress(InvalidStateError):  # then from where it was when a state was measured last
            self.measure(-math.inf)
        if self._servo is None or self._state is None:
            raise InvalidStateError("nothing is measured yet")
        return self._servo.act(self._state, action)

    def close(self) -> None:
        """Release the model's resources."""
        self._model.close()
