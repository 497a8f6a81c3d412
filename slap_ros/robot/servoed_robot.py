# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot at a bench that is commanded while it moves, as far as encoders and detections say.

A state of the contact world has velocities, what is held, and where the hand was told to be. The
joints give the hand's velocity. Things that are detected in one place are at rest there; others
move as their last detections do, and so does what slides or turns of a drawer or a lid, which says
how far that is open. What is between fingers that were told to close and stand is held:
it goes with the hand, for detections are older than encoders. And what was told is known.

A camera does not see what the arm or a roof hides: that is where it was seen last, or where it was
let go, or has gone with the drawer that it lies in.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace

from slap_ros.core import Action, Domain
from slap_ros.errors import (
    InvalidMeasurementError,
    InvalidParameterError,
    InvalidSceneError,
    InvalidStateError,
    NoJointStateError,
)
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import Object, State
from slap_ros.robot.bench_supports import lifted_out, moving_support, put_down
from slap_ros.robot.carried_body import CarriedBody, is_between
from slap_ros.robot.detected_objects import DetectedObjects
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import Joints, Workspace
from slap_ros.robot.opening_sensor import OpeningSensor
from slap_ros.robot.scene_config import SceneConfig
from slap_ros.robot.servoing import HandServo, ServoCommand, moving_hand
from slap_ros.robot.state_assembly import possible_joints
from slap_ros.robot.tracking import Detection, PoseEstimate, Track, TrackingSettings, still
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex, ContactSnapshot, Opening
from slap_ros.worlds.contact.validation import require_possible_bodies
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_OPEN, grasp_pose

REMEMBERED = 256  # joint readings, for where the hand was when something was detected
STANDING = 0.005  # m/s, of each finger: slower ones press, or are at their end
STOPPED = 0.005  # m, from its end, of a finger that was told to close
RATE_S = 0.02  # s, over which the fingers' velocity is taken


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


def stands(hand: HandState) -> bool:
    """Whether fingers press, or are at their end."""
    return max(map(abs, hand.finger_velocities)) <= STANDING


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
        self._openings = {
            self._object(body.name): OpeningSensor(body, pose)
            for body, pose in zip(scene.jointed, self._placement.jointed, strict=True)
        }
        self._tracking = tracking
        self._detected = DetectedObjects(scene_config, tracking, self._in_hand, self._openings)
        self._carried: CarriedBody | None = None
        self._aboard: dict[int, tuple[int, Pose]] = {}  # bodies: in which drawer's part, and where
        self._lying: dict[int, Pose] = {}  # on what supports them, of bodies that a camera saw last
        self._let_go: dict[Object, Detection] = {}  # where and when the hand had something last
        self._readings: deque[JointReading] = deque(maxlen=REMEMBERED)
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
        self._detected.add(frame, stamp_s * self._pace, base, seen)

    def add_picture(self, stamp_s: float) -> None:
        """Take that a picture was searched: what none of several shows is hidden.

        Args:
            stamp_s: Time at which it was taken, s.
        """
        self._detected.add_picture(stamp_s * self._pace)

    def add_joint_reading(self, reading: JointReading) -> None:
        """Take joint positions.

        Raises:
            InvalidMeasurementError: They are older than the last ones.
        """
        taken = replace(reading, stamp_s=reading.stamp_s * self._pace)
        if self._readings and taken.stamp_s <= self._readings[-1].stamp_s:
            raise InvalidMeasurementError("joint positions are not newer than those before")
        self._readings.append(taken)

    @property
    def newest_joints_s(self) -> float:
        """Stamp of the newest joint positions; minus infinity without any."""
        return self._readings[-1].stamp_s / self._pace if self._readings else -math.inf

    @property
    def arm_moves(self) -> bool:
        """Whether the arm moved when its joints were measured last."""
        return bool(self._readings) and not self._readings[-1].at_rest

    def undetected(self, since_s: float) -> list[str]:
        """Names of the objects that were not detected since a time, s, without those hidden since.

        Where detections of one come and are refused, its name is followed by the reason.
        """
        detected = self._detected
        unseen = [
            obj
            for obj, track in detected.tracks.items()
            if track.newest_s <= since_s * self._pace
            and not (track.newest_s > -math.inf and self._is_hidden(obj))
        ]
        refused = detected.refusals
        return [f"{o.name} ({refused[o]})" if o in refused else o.name for o in unseen]

    @property
    def hidden(self) -> list[str]:
        """Names of the objects that the last pictures do not show."""
        return [obj.name for obj in self._detected.tracks if self._is_hidden(obj)]

    @property
    def never_shown(self) -> list[str]:
        """Names of the objects that no picture has ever shown, where pictures show others."""
        never = self._detected.never_seen()
        others = self._detected.has_pictures and len(never) < len(self._detected.tracks)
        return [obj.name for obj in never] if others else []

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
        if self.undetected(since_s) or not self._readings or self.arm_moves:
            return None
        newest = self._readings[-1]
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
        if self.newest_joints_s <= since_s or len(self._readings) < 2:
            return None
        hand, joints = self._hand(told)
        self._follow_carried(hand)
        bodies, openings = self._bodies(hand), self._measured_openings()
        if bodies is None or openings is None:
            return None
        jointed = zip(self._model.scene.jointed, self._placement.jointed, openings, strict=True)
        parts = [body.moving_pose(pose, opening.position) for body, pose, opening in jointed]
        gone = self._gone_along(openings)
        bodies = self._with_drawers(bodies, parts, gone)
        eyes = self._eyes(bodies, gone)
        bodies = put_down(self._model.scene, self._placement, bodies, openings, eyes)
        self._lying = {i: bodies[i].pose for i in eyes}
        self._note_aboard(bodies, parts, gone)
        bodies = self._off_support(hand, bodies, openings)
        held = self._carried.index if self._carried is not None and stands(hand) else None
        snapshot = ContactSnapshot(joints, hand, bodies, openings, held)
        state = self._index.write(self._template, snapshot)
        state.require_finite()
        require_possible_bodies(self._model.scene, snapshot, self._placement, self.hidden)
        self._state = state
        return state

    def _hand(self, told: HandCommand) -> tuple[HandState, Joints]:
        """The hand and the joints of the newest reading."""
        newest, earlier = self._readings[-1], self._reading_at(self._readings[-1].stamp_s - RATE_S)
        if newest.gap is None or earlier.gap is None:
            raise NoJointStateError("joint states have no positions of the fingers")
        joints = tuple(possible_joints(newest.joints))
        passed_s, finger = newest.stamp_s - earlier.stamp_s, 0.5 * newest.gap
        opening = 0.5 * (newest.gap - earlier.gap) / passed_s
        rates = newest.velocities or tuple(
            (b - a) / passed_s for a, b in zip(earlier.joints, newest.joints, strict=True)
        )
        hand = moving_hand(joints, rates, (finger, finger), (opening, opening), told)
        return hand, joints

    def _reading_at(self, stamp_s: float) -> JointReading:
        """The last reading before a time, or else the first that is known, never the newest."""
        before = [one for one in list(self._readings)[:-1] if one.stamp_s <= stamp_s]
        return before[-1] if before else self._readings[0]

    def _bodies(self, hand: HandState) -> tuple[BodyState, ...] | None:
        """How bodies lie or move; None as long as one was not detected often enough."""
        found = []
        for i, body in enumerate(self._model.scene.free):
            if self._carried is not None and self._carried.index == i:
                found.append(self._carried.motion(hand))
                continue
            motion = self._motion(self._object(body.name))
            if motion is None:
                return None
            found.append(BodyState(motion.pose, motion.velocity, motion.spin))
        return tuple(found)

    def _with_drawers(
        self, bodies: Sequence[BodyState], parts: Sequence[Pose], gone: Collection[int]
    ) -> tuple[BodyState, ...]:
        """The bodies, with some gone with the drawers that they were seen in, or let go in.

        Args:
            bodies: How the bodies lie or move, as they were seen last.
            parts: Poses of what opens of drawers and lids.
            gone: Indices of those that have gone along.
        """
        found = list(bodies)
        for i in gone:
            k, pose = self._aboard[i]
            found[i] = BodyState(parts[k].compose(pose), ORIGIN, ORIGIN)
        return tuple(found)

    def _note_aboard(
        self, bodies: Sequence[BodyState], parts: Sequence[Pose], gone: Collection[int]
    ) -> None:
        """Keep which bodies lie in drawers, and where in them.

        Args:
            bodies: How the bodies lie or move.
            parts: Poses of what opens of drawers and lids.
            gone: Indices of bodies that have gone along with drawers.
        """
        for i, body in enumerate(bodies):
            by_camera = self._track(self._model.scene.free[i].name).newest.eye is not None
            if i in gone or not by_camera or not (body.still or self._is_carried(i)):
                continue
            self._aboard.pop(i, None)
            support = moving_support(self._model.scene, parts, i, body.pose)
            if support is not None and not self._is_carried(i):
                self._aboard[i] = support, parts[support].inverse().compose(body.pose)

    def _gone_along(self, openings: Sequence[Opening]) -> set[int]:
        """Indices of bodies in drawers that are hidden, or whose drawers move.

        Args:
            openings: How far drawers and lids are open.
        """
        free = self._model.scene.free
        return {
            i
            for i, (part, _) in self._aboard.items()
            if not self._is_carried(i)
            and (not openings[part].still or self._is_hidden(self._object(free[i].name)))
        }

    def _is_carried(self, index: int) -> bool:
        return self._carried is not None and self._carried.index == index

    def _eyes(self, bodies: Sequence[BodyState], gone: Collection[int]) -> dict[int, Vector]:
        """Where the camera is that saw a body at rest, by the body's index.

        Args:
            bodies: How the bodies lie or move.
            gone: Indices of bodies that have gone along with drawers.
        """
        names = [body.name for body in self._model.scene.free]
        eyes = {i: self._track(name).newest.eye for i, name in enumerate(names) if bodies[i].still}
        return {
            i: eye
            for i, eye in eyes.items()
            if eye is not None and i not in gone and not self._is_carried(i)
        }

    def _off_support(
        self, hand: HandState, bodies: tuple[BodyState, ...], openings: Sequence[Opening]
    ) -> tuple[BodyState, ...]:
        """The bodies, with a carried one that a camera sees raised out of what it is put down on.

        Args:
            hand: The hand now.
            bodies: How the bodies lie or move.
            openings: How far drawers and lids are open.
        """
        if self._carried is None:
            return bodies
        i = self._carried.index
        if self._track(self._model.scene.free[i].name).newest.eye is None:
            return bodies
        pose = lifted_out(self._model.scene, self._placement, bodies, openings, i)
        self._carried = replace(self._carried, pose=hand.pose.inverse().compose(pose))
        return (*bodies[:i], bodies[i]._replace(pose=pose), *bodies[i + 1 :])

    def _measured_openings(self) -> tuple[Opening, ...] | None:
        """How far drawers and lids are open; None as long as one was not detected often enough."""
        found = []
        for obj, sensor in self._openings.items():
            motion = self._motion(obj)
            if motion is None:
                return None
            found.append(sensor.opening(motion))
        return tuple(found)

    def _motion(self, obj: Object) -> PoseEstimate | None:
        """What is known of an object that the hand does not carry; None where that is too little.

        What is hidden is at rest where it was seen last, or was let go.
        """
        track, let_go = self._detected.tracks[obj], self._let_go.get(obj)
        since_s = -math.inf if let_go is None else let_go.stamp_s
        motion, lying = track.newest_motion(since_s), self._lying_since(obj, since_s)
        if lying is not None and self._is_hidden(obj):
            return lying
        if motion is None and let_go is not None:
            last = track.newest if track.newest_s > let_go.stamp_s else let_go
            return still(last.pose, 1, last.eye)
        if motion is None:
            return None
        if self._is_hidden(obj):
            return still(motion.pose, motion.weight, motion.eye)
        return motion

    def _lying_since(self, obj: Object, since_s: float) -> PoseEstimate | None:
        """Where a thing lies that a camera has seen there often; None where it may be elsewhere.

        Args:
            obj: Object that is detected.
            since_s: Time at which the hand let go of it, s.
        """
        track = self._detected.tracks[obj]
        if obj in self._openings or track.newest_s <= since_s:
            return None
        sure = track.estimate(since_s)
        if sure is not None and sure.at_rest and sure.eye is not None:
            track.remember(sure)
        return track.last_at_rest

    def _is_hidden(self, obj: Object) -> bool:
        return self._detected.is_hidden(obj, -math.inf, self._tracking.hidden_after)

    def _follow_carried(self, hand: HandState) -> None:
        """Find out what goes with the hand from now on, and where in it that is."""
        if self._carried is None:
            if hand.closing:
                self._carried = self._grasped(hand)
            return
        body = self._model.scene.free[self._carried.index]
        newest = self._track(body.name).newest
        if newest.stamp_s > self._carried.seen_s:
            then = grasp_pose(self._reading_at(newest.stamp_s).joints)
            self._carried = self._carried.seen(newest, then)
        if newest.eye is not None and stands(hand):
            self._carried = self._carried.centred(hand, body.parts)
        pose = hand.pose.compose(self._carried.pose)
        if not (hand.closing and is_between(hand, body.parts, pose)):
            self._carried = None
        elif newest.eye is not None:
            now_s = self._readings[-1].stamp_s
            self._let_go[self._object(body.name)] = Detection(now_s, pose, eye=newest.eye)
            self._track(body.name).forget()

    def _grasped(self, hand: HandState) -> CarriedBody | None:
        """The body that is between the fingers: where it was detected, or gone with them since.

        What a camera saw goes with them from when they touch it: it does not see that they move it.
        """
        now_s = self._readings[-1].stamp_s
        for i, body in enumerate(self._model.scene.free):
            motion = self._motion(self._object(body.name))
            if motion is None or not (stands(hand) or motion.eye is not None):
                continue
            seen_s = self._track(body.name).newest_s
            then = grasp_pose(self._reading_at(seen_s).joints)
            lay = self._lying.get(i, motion.pose)
            for at, pose in ((hand.pose, lay), (then, motion.pose)):
                in_hand = at.inverse().compose(pose)
                if is_between(hand, body.parts, hand.pose.compose(in_hand)):
                    return CarriedBody(i, in_hand, now_s, seen_s)
        return None

    def _in_hand(self, obj: Object) -> Pose | None:
        """Where the hand has an object; None where it does not carry it."""
        carried = self._carried
        if carried is None or self._object(self._model.scene.free[carried.index].name) != obj:
            return None
        return grasp_pose(self._readings[-1].joints).compose(carried.pose)

    def _track(self, name: str) -> Track:
        return self._detected.tracks[self._object(name)]

    def _object(self, name: str) -> Object:
        return self._template.layout.object(name)

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
