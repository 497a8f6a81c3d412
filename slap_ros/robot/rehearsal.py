# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded plan for a robot to execute without looking: what it comes to, checked beforehand.

Open loop, as LG-SAIL executes on its robot what was planned in simulation: joint positions of the
recorded states one after the other, each from rest to rest, and what the gripper did between them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from slap_ros.bags.reader import read_bag
from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.core import Domain
from slap_ros.errors import DamagedBagError, InvalidParameterError, UnsafeCommandError
from slap_ros.messages.decode import decode_goal, decode_state
from slap_ros.physics.features import JOINT_FEATURES, ROBOT
from slap_ros.physics.panda import grasp_pose
from slap_ros.relational import State
from slap_ros.robot.cell import Grip
from slap_ros.robot.limits import PEAK_ACCELERATION, PEAK_VELOCITY, Joints, Limits, Motion


@dataclass(frozen=True)
class Waypoint:
    """Where the arm goes in a step, after the gripper acted."""

    step: int  # at whose end it is there
    joints: Joints  # rad
    grip: Grip
    gap: float  # m, between the fingers around what is held; 0 where nothing is


@dataclass(frozen=True)
class Recorded:
    """The motion of a recorded episode."""

    domain: Domain
    seed: int  # of the task, as the recording has it
    index: int
    states: tuple[State, ...]  # from the first on
    waypoints: tuple[Waypoint, ...]  # one for each state but the first
    goal: int  # mask, in the atom space of the first state

    @property
    def start(self) -> Joints:
        """Where the arm was at the beginning, rad."""
        return _joints(self.states[0])


def recorded_motion(path: Path) -> Recorded:
    """The motion of the newest episode in a bag.

    Raises:
        DamagedBagError: It breaks off, or lacks a state: half a plan is none for a robot.
        InvalidParameterError: Its domain has no Panda, or it begins with something in the hand.
        ForeignBagError, UnknownDomainError, InvalidStateError: As for any replay.
    """
    bag = read_bag(path)
    recording = Recording.of(bag)
    domain = recording.domain()
    if bag.damage is not None or domain is None:
        reason = bag.damage or "it does not name its domain"
        raise DamagedBagError(f"{path} is not to be executed: {reason}")
    if ROBOT not in domain.types:
        raise InvalidParameterError(f"{domain.name} has no Panda, which a real robot is here")
    moved = [episode for _, episode in sorted(recording.episodes.items()) if episode.states]
    if not moved or moved[-1].task is None:
        raise DamagedBagError(f"{path} has no task with states, so there is nothing to execute")
    episode, task = moved[-1], moved[-1].task
    states = tuple(_states(episode, domain))
    if _holds(states[0]):
        raise InvalidParameterError(
            f"{path} begins with something in the hand, and nobody could put it there just so"
        )
    space = domain.atom_space(states[0])
    return Recorded(
        domain,
        task.seed,
        task.index,
        states,
        tuple(_waypoints(states)),
        space.mask(decode_goal(task.goal, space)),
    )


def _states(episode: RecordedEpisode, domain: Domain) -> Iterator[State]:
    for number, step in enumerate(sorted(episode.states)):
        if step != number:
            raise DamagedBagError(f"the state of step {number} is not in the bag")
        yield decode_state(episode.states[step], domain.types_by_name)


def _waypoints(states: Sequence[State]) -> Iterator[Waypoint]:
    holding = _holds(states[0])
    for step, state in enumerate(states[1:], start=1):
        held, holding = holding, _holds(state)
        grip = Grip.KEEP if held == holding else Grip.CLOSE if holding else Grip.OPEN
        (robot,) = state.layout.of_type(ROBOT)
        gap = 2.0 * float(state.get(robot, "finger")) if holding else 0.0
        yield Waypoint(step, _joints(state), grip, gap)


def _holds(state: State) -> bool:
    return any(state.get(o, "held") > 0.5 for o in state.objects if "held" in o.type.column)


def _joints(state: State) -> Joints:
    (robot,) = state.layout.of_type(ROBOT)
    return tuple(float(state.get(robot, feature.name)) for feature in JOINT_FEATURES)


@dataclass(frozen=True)
class Extreme:
    """The place of a motion that comes closest to a limit, or goes farthest beyond it."""

    quantity: str
    value: float
    low: float
    high: float
    unit: str
    step: int

    @property
    def share(self) -> float:
        """How much of what is allowed it takes: more than 1 is too much."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return abs(self.value - middle) / half


@dataclass(frozen=True)
class Rehearsal:
    """A motion against the limits of an arm."""

    motions: tuple[Motion, ...]  # one a waypoint; fewer, if it must not be executed
    extremes: tuple[Extreme, ...]
    violations: tuple[tuple[int, str], ...]  # step and reason

    @property
    def duration_s(self) -> float:
        """How long the arm moves."""
        return sum(motion.duration_s for motion in self.motions)

    def require_safe(self) -> None:
        """Refuse a motion that must not be executed.

        Raises:
            UnsafeCommandError: Says where it first goes too far, and how often.
        """
        if self.violations:
            step, reason = self.violations[0]
            raise UnsafeCommandError(
                f"step {step} of the recording: {reason}; "
                f"{len(self.violations)} of its steps go beyond the limits of this arm"
            )


def rehearse(recorded: Recorded, limits: Limits) -> Rehearsal:
    """Check every waypoint: positions, velocities, accelerations, workspace. Nothing moves."""
    motions, violations = [], []
    at = recorded.start
    for waypoint in recorded.waypoints:
        try:
            motions.append(
                limits.motion(at, waypoint.joints, recorded.domain.execution.control_period_s)
            )
        except UnsafeCommandError as error:
            violations.append((waypoint.step, str(error)))
        at = waypoint.joints
    return Rehearsal(tuple(motions), tuple(_extremes(recorded, limits, motions)), tuple(violations))


def _extremes(recorded: Recorded, limits: Limits, motions: Sequence[Motion]) -> Iterator[Extreme]:
    places = [(0, recorded.start), *((w.step, w.joints) for w in recorded.waypoints)]
    yield _worst(
        Extreme(f"joint {i + 1}", q[i], limits.low[i], limits.high[i], "rad", step)
        for step, q in places
        for i in range(len(q))
    )
    ways = [
        (b_step, i, b[i] - a[i]) for (_, a), (b_step, b) in pairwise(places) for i in range(len(a))
    ]
    yield _worst(
        Extreme(f"joint {i + 1} in a step", way, -limits.step[i], limits.step[i], "rad", step)
        for step, i, way in ways
    )
    for name, unit, peak, allowed in (
        ("velocity", "rad/s", _peak_velocity, limits.velocity),
        ("acceleration", "rad/s²", _peak_acceleration, limits.acceleration),
    ):
        yield _worst(_peaks(name, unit, peak, allowed, recorded, motions))
    points = [(step, grasp_pose(q).position) for step, q in places]
    box = limits.workspace
    for i, axis in enumerate("xyz"):
        yield _worst(
            Extreme(f"fingertips {axis}", point[i], box.low[i], box.high[i], "m", step)
            for step, point in points
        )


def _peaks(
    name: str,
    unit: str,
    peak: Callable[[float, float], float],
    allowed: Joints,
    recorded: Recorded,
    motions: Sequence[Motion],
) -> Iterator[Extreme]:
    steps = {waypoint.joints: waypoint.step for waypoint in recorded.waypoints}
    yield Extreme(f"{name} of joint 1", 0.0, -allowed[0], allowed[0], unit, 0)
    for motion in motions:
        for i, (a, b) in enumerate(zip(motion.start, motion.target, strict=True)):
            value = peak(abs(b - a), motion.duration_s)
            where = steps[motion.target]
            yield Extreme(f"{name} of joint {i + 1}", value, -allowed[i], allowed[i], unit, where)


def _peak_velocity(way: float, duration_s: float) -> float:
    return PEAK_VELOCITY * way / duration_s


def _peak_acceleration(way: float, duration_s: float) -> float:
    return PEAK_ACCELERATION * way / duration_s**2


def _worst(extremes: Iterator[Extreme]) -> Extreme:
    return max(extremes, key=lambda extreme: extreme.share)
