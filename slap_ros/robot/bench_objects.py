# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Things at a bench, as far as detections and encoders say.

Things that are detected in one place are at rest there; others move as their last detections do,
and so does what slides or turns of a drawer or a lid, which says how far that is open. What is
between fingers that were told to close and stand is held: it goes with the hand, for detections are
older than encoders.

A camera does not see what the arm or a roof hides: that is where it was seen last, or where it was
let go, or has gone with the drawer that it lies in.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import Object
from slap_ros.robot.bench_supports import lifted_out, moving_support, put_down
from slap_ros.robot.carried_body import CarriedBody, is_between
from slap_ros.robot.detected_objects import DetectedObjects
from slap_ros.robot.joint_history import JointHistory
from slap_ros.robot.opening_sensor import OpeningSensor
from slap_ros.robot.scene_config import SceneConfig
from slap_ros.robot.tracking import Detection, PoseEstimate, Track, TrackingSettings, still
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import Opening, Placement
from slap_ros.worlds.layout_index import BodyState

STANDING = 0.005  # m/s, of each finger: slower ones press, or are at their end


def stands(hand: HandState) -> bool:
    """Whether fingers press, or are at their end."""
    return max(map(abs, hand.finger_velocities)) <= STANDING


@dataclass(frozen=True)
class MeasuredBench:
    """How things at a bench are.

    Args:
        bodies: How the free bodies of the scene lie or move.
        openings: How far drawers and lids are open.
        held: Index of the body that the hand holds; None where it holds none.
    """

    bodies: tuple[BodyState, ...]
    openings: tuple[Opening, ...]
    held: int | None


class BenchObjects:
    """What is known of the things at a bench.

    Args:
        scene_config: Objects of the scene, and how they are detected.
        scene: Bodies of the scene.
        placement: Poses of the bodies that do not move.
        tracking: Settings of how far detections can be trusted.
        history: Joint positions, with which what the hand has goes.
    """

    def __init__(
        self,
        scene_config: SceneConfig,
        scene: ContactScene,
        placement: Placement,
        tracking: TrackingSettings,
        history: JointHistory,
    ) -> None:
        self._layout = scene_config.template.layout
        self._scene, self._placement, self._history = scene, placement, history
        self._openings = {
            self._object(body.name): OpeningSensor(body, pose)
            for body, pose in zip(scene.jointed, placement.jointed, strict=True)
        }
        self._tracking = tracking
        self.detected = DetectedObjects(scene_config, tracking, self._in_hand, self._openings)
        self._carried: CarriedBody | None = None
        self._aboard: dict[int, tuple[int, Pose]] = {}  # bodies: in which drawer's part, and where
        self._lying: dict[int, Pose] = {}  # on what supports them, of bodies that a camera saw last
        self._let_go: dict[Object, Detection] = {}  # where and when the hand had something last

    # -- what is seen ---------------------------------------------------------------------------

    def undetected(self, since_s: float) -> list[str]:
        """Names of the objects that were not detected since a time, s, without those hidden since.

        Where detections of one come and are refused, its name is followed by the reason.
        """
        detected = self.detected
        unseen = [
            obj
            for obj, track in detected.tracks.items()
            if track.newest_s <= since_s
            and not (track.newest_s > -math.inf and self._is_hidden(obj))
        ]
        refused = detected.refusals
        return [f"{o.name} ({refused[o]})" if o in refused else o.name for o in unseen]

    @property
    def hidden(self) -> list[str]:
        """Names of the objects that the last pictures do not show."""
        return [obj.name for obj in self.detected.tracks if self._is_hidden(obj)]

    @property
    def never_shown(self) -> list[str]:
        """Names of the objects that no picture has ever shown, where pictures show others."""
        never = self.detected.never_seen()
        others = self.detected.has_pictures and len(never) < len(self.detected.tracks)
        return [obj.name for obj in never] if others else []

    # -- where things are -----------------------------------------------------------------------

    def measure(self, hand: HandState) -> MeasuredBench | None:
        """How everything is now; None as long as something was not detected often enough.

        Args:
            hand: The hand now.
        """
        self._follow_carried(hand)
        bodies, openings = self._bodies(hand), self._measured_openings()
        if bodies is None or openings is None:
            return None
        jointed = zip(self._scene.jointed, self._placement.jointed, openings, strict=True)
        parts = [body.moving_pose(pose, opening.position) for body, pose, opening in jointed]
        gone = self._gone_along(openings)
        bodies = self._with_drawers(bodies, parts, gone)
        eyes = self._eyes(bodies, gone)
        bodies = put_down(self._scene, self._placement, bodies, openings, eyes)
        self._lying = {i: bodies[i].pose for i in eyes}
        self._note_aboard(bodies, parts, gone)
        bodies = self._off_support(hand, bodies, openings)
        held = self._carried.index if self._carried is not None and stands(hand) else None
        return MeasuredBench(bodies, openings, held)

    def _bodies(self, hand: HandState) -> tuple[BodyState, ...] | None:
        """How bodies lie or move; None as long as one was not detected often enough."""
        found = []
        for i, body in enumerate(self._scene.free):
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
            by_camera = self._track(self._scene.free[i].name).newest.eye is not None
            if i in gone or not by_camera or not (body.still or self._is_carried(i)):
                continue
            self._aboard.pop(i, None)
            support = moving_support(self._scene, parts, i, body.pose)
            if support is not None and not self._is_carried(i):
                self._aboard[i] = support, parts[support].inverse().compose(body.pose)

    def _gone_along(self, openings: Sequence[Opening]) -> set[int]:
        """Indices of bodies in drawers that are hidden, or whose drawers move.

        Args:
            openings: How far drawers and lids are open.
        """
        free = self._scene.free
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
        names = [body.name for body in self._scene.free]
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
        if self._track(self._scene.free[i].name).newest.eye is None:
            return bodies
        pose = lifted_out(self._scene, self._placement, bodies, openings, i)
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
        track, let_go = self.detected.tracks[obj], self._let_go.get(obj)
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
        track = self.detected.tracks[obj]
        if obj in self._openings or track.newest_s <= since_s:
            return None
        sure = track.estimate(since_s)
        if sure is not None and sure.at_rest and sure.eye is not None:
            track.remember(sure)
        return track.last_at_rest

    def _is_hidden(self, obj: Object) -> bool:
        return self.detected.is_hidden(obj, -math.inf, self._tracking.hidden_after)

    def _follow_carried(self, hand: HandState) -> None:
        """Find out what goes with the hand from now on, and where in it that is."""
        if self._carried is None:
            if hand.closing:
                self._carried = self._grasped(hand)
            return
        body = self._scene.free[self._carried.index]
        newest = self._track(body.name).newest
        if newest.stamp_s > self._carried.seen_s:
            then = self._history.hand_before(newest.stamp_s)
            self._carried = self._carried.seen(newest, then)
        if newest.eye is not None and stands(hand):
            self._carried = self._carried.centred(hand, body.parts)
        pose = hand.pose.compose(self._carried.pose)
        if not (hand.closing and is_between(hand, body.parts, pose)):
            self._carried = None
        elif newest.eye is not None:
            now_s = self._history.newest_s
            self._let_go[self._object(body.name)] = Detection(now_s, pose, eye=newest.eye)
            self._track(body.name).forget()

    def _grasped(self, hand: HandState) -> CarriedBody | None:
        """The body that is between the fingers: where it was detected, or gone with them since.

        What a camera saw goes with them from when they touch it: it does not see that they move it.
        """
        now_s = self._history.newest_s
        for i, body in enumerate(self._scene.free):
            motion = self._motion(self._object(body.name))
            if motion is None or not (stands(hand) or motion.eye is not None):
                continue
            seen_s = self._track(body.name).newest_s
            then = self._history.hand_before(seen_s)
            lay = self._lying.get(i, motion.pose)
            for at, pose in ((hand.pose, lay), (then, motion.pose)):
                in_hand = at.inverse().compose(pose)
                if is_between(hand, body.parts, hand.pose.compose(in_hand)):
                    return CarriedBody(i, in_hand, now_s, seen_s)
        return None

    def _in_hand(self, obj: Object) -> Pose | None:
        """Where the hand has an object; None where it does not carry it."""
        carried = self._carried
        if carried is None or self._object(self._scene.free[carried.index].name) != obj:
            return None
        return self._history.newest_hand.compose(carried.pose)

    def _track(self, name: str) -> Track:
        return self.detected.tracks[self._object(name)]

    def _object(self, name: str) -> Object:
        return self._layout.object(name)
