# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the bodies and the arm were at each step."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from math import nan

from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.core import Domain, VisibleBody
from slap_ros.drawing.projection import drawable, is_near
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.geometry.pose import Vector
from slap_ros.messages.decode import decode_state, stamp_ns
from slap_ros.messages.interfaces import BODIES, CUBE, TRIANGLE_LIST
from slap_ros.messages.protocols import MarkersMessage, StateMessage
from slap_ros.report.traces import robot_types
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.panda import HAND, JOINTS, LINKS, link_poses

MAX_BODIES = 64  # a frame
MAX_FRAMES = 600  # a run; of a longer one, every second or third step and so on
WRIST_M = 0.04  # m, above the hand's frame: where the round end of the arm meets the hand
FINGERS = ("left_finger", "right_finger")
METAL = (0.62, 0.65, 0.69, 1.0)  # of the hand


@dataclass(frozen=True)
class SceneFrame:
    """Where everything is at one step."""

    step: int  # from the run's start
    bodies: tuple[VisibleBody, ...]  # in the world frame; the n-th is the same in every frame
    arm: tuple[Vector, ...]  # m: where its joints are, from the base to the hand; may be empty


@dataclass(frozen=True)
class RecordedScene:
    """The frames of a run."""

    frames: tuple[SceneFrame, ...]  # in the order of their steps

    @property
    def ends(self) -> list[tuple[VisibleBody, VisibleBody]]:
        """Each body at the beginning and at the end."""
        return list(zip(self.frames[0].bodies, self.frames[-1].bodies, strict=False))


def scene(
    trace: RunTrace, episode: RecordedEpisode, recording: Recording, domain: Domain | None
) -> RecordedScene | None:
    """The frames of a run; None where nothing in the bag says what bodies look like.

    Bodies are those of the recorded markers; without markers, those that the domain displays.

    Args:
        trace: Run to show.
        episode: Recorded episode with the run's states.
        recording: Markers, and the layout of the robot's features.
        domain: Domain of the bag; None where it is not known here.

    Raises:
        InvalidStateError: It has a state that its domain cannot have.
    """
    steps = sorted(s for s in episode.states if trace.first_step <= s <= trace.last_step)
    if not steps:
        return None
    chosen = steps[:: 1 + len(steps) // MAX_FRAMES]
    if chosen[-1] != steps[-1]:
        chosen.append(steps[-1])
    pictures, frames = _BodyFinder(episode, recording, domain), []
    for step in chosen:
        hand, arm = _arm(episode.states[step], recording, robot_types(domain))
        bodies = (*hand, *pictures.of(episode.states[step]))
        frames.append(SceneFrame(step - trace.first_step, bodies, arm))
    return RecordedScene(tuple(frames)) if any(f.bodies or f.arm for f in frames) else None


class _BodyFinder:
    """Finds the bodies that were shown of a state."""

    def __init__(
        self, episode: RecordedEpisode, recording: Recording, domain: Domain | None
    ) -> None:
        # What is shown of a state has its stamp. The order is that of the steps.
        stamps = {step: stamp_ns(state.header) for step, state in episode.states.items()}
        shown = recording.markers
        self._markers = {step: shown[at] for step, at in stamps.items() if at in shown}
        self._steps = sorted(self._markers)
        self._domain = domain

    def of(self, state: StateMessage) -> tuple[VisibleBody, ...]:
        """The bodies of the state's markers, or of the next state's that has some."""
        shown: Iterable[VisibleBody] = ()
        if self._steps:
            since = bisect_left(self._steps, state.step)
            step = self._steps[min(since, len(self._steps) - 1)]
            shown = _of_markers(self._markers[step])
        elif self._domain is not None:
            shown = self._domain.display.bodies(decode_state(state, self._domain.types_by_name))
        return tuple(drawable(shown))[:MAX_BODIES]


def _of_markers(message: MarkersMessage) -> Iterable[VisibleBody]:
    for marker in message.markers:
        if marker.ns == BODIES and marker.type in (CUBE, TRIANGLE_LIST):
            p, q, s, c = marker.pose.position, marker.pose.orientation, marker.scale, marker.color
            points = marker.points if marker.type == TRIANGLE_LIST else ()
            yield VisibleBody(
                marker.text,
                (float(p.x), float(p.y), float(p.z)),
                (float(q.x), float(q.y), float(q.z), float(q.w)),
                (float(s.x), float(s.y), float(s.z)),
                (float(c.r), float(c.g), float(c.b), float(c.a)),
                tuple((float(point.x), float(point.y), float(point.z)) for point in points),
            )


# The hand and the fingers; the links before them are drawn as lines.
HAND_SHAPES = tuple(shape for shape in LINK_SHAPES if shape.link >= HAND)


def _arm(
    state: StateMessage, recording: Recording, robots: Collection[str]
) -> tuple[tuple[VisibleBody, ...], tuple[Vector, ...]]:
    """The hand's parts and the points of the arm, of a robot that has the Panda's joints."""
    features = _robot_features(state, recording, robots)
    if "finger" in features:  # both are at the same distance from the middle
        features |= dict.fromkeys(FINGERS, features["finger"])
    names = [*(f"joint{i + 1}" for i in range(JOINTS)), *FINGERS]
    if not all(is_near(features.get(name, nan)) for name in names):
        return (), ()
    *joints, left, right = (features[name] for name in names)
    links = link_poses(joints, left, right)
    parts = []
    for shape in HAND_SHAPES:
        box = shape.at(links[shape.link])
        x, y, z = (2.0 * half for half in box.half)
        name = LINKS[shape.link]
        parts.append(VisibleBody(name, box.pose.position, box.pose.quaternion, (x, y, z), METAL))
    wrist = links[HAND].apply((0.0, 0.0, -WRIST_M))
    return tuple(parts), (*(link.position for link in links[:HAND]), wrist)


def _robot_features(
    state: StateMessage, recording: Recording, robots: Collection[str]
) -> dict[str, float]:
    """The features of the first robot, by name."""
    info = recording.domain_info
    layouts = {t.name: t.feature_names for t in info.types} if info is not None else {}
    for obj in state.objects:
        names = layouts.get(obj.type, ())
        if obj.type in robots and len(names) == len(obj.features):
            return dict(zip(names, map(float, obj.features), strict=True))
    return {}
