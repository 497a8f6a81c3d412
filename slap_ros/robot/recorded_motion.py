# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded plan as a motion of the arm, for a robot to execute without looking.

Open loop, as LG-SAIL executes on its robot what was planned in simulation: joint positions of the
recorded states one after the other, each from rest to rest, and what the gripper did between them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from slap_ros.bags.reader import read_bag
from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.core import Domain
from slap_ros.errors import ControllerAbortedError, DamagedBagError, InvalidParameterError
from slap_ros.messages.decode import decode_goal, decode_state
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.robot.grasp_tracking import GRASPED
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.limits import Joints, Limits
from slap_ros.worlds.contact.arm import MAX_JOINT_STEP
from slap_ros.worlds.contact.features import GRIPPER
from slap_ros.worlds.contact.features import ROBOT as HAND_OF_FORCES
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.panda import MAX_STEP

STOPS = 1e-3  # m, in a step: fingers on their way come 15 times as much closer


@dataclass(frozen=True)
class RecordedWaypoint:
    """Where the arm goes in a step, after the gripper acted."""

    step: int  # at whose end it is there
    joints: Joints  # rad
    gripper: GripperAction
    gap: float  # m, between the fingers around what is held; 0 where nothing is

    def require_grasp(self, gap: float) -> None:
        """Refuse fingers that closed around nothing, unless those of the recording did as well.

        Args:
            gap: Distance between the fingers once they have closed, m; shut ones may measure
                less than 0.

        Raises:
            ControllerAbortedError: They are closer together than around what should be there.
        """
        if max(gap, 0.0) < GRASPED * self.gap:
            raise ControllerAbortedError(
                f"the fingers closed around nothing in step {self.step}: {gap:.3f} m apart, "
                f"{self.gap:.3f} m in the recording"
            )


@dataclass(frozen=True)
class RecordedMotion:
    """The motion of a recorded episode."""

    domain: Domain
    seed: int  # of the task, as the recording has it
    index: int
    states: tuple[State, ...]  # from the first on
    waypoints: tuple[RecordedWaypoint, ...]  # one for each state but the first
    goal: int  # mask, in the atom space of the first state

    @classmethod
    def of(
        cls,
        domain: Domain,
        seed: int,
        index: int,
        states: Sequence[State],
        goal: Iterable[GroundAtom],
    ) -> RecordedMotion:
        """The motion of the arm through states.

        Args:
            domain: Domain with a Panda.
            seed: Seed of the task.
            index: Index of the task.
            states: States of the episode, from the first on.
            goal: Goal of the task.
        """
        space = domain.atom_space(states[0])
        waypoints = _pressing(states) if HAND_OF_FORCES in domain.types else _waypoints(states)
        return cls(domain, seed, index, tuple(states), tuple(waypoints), space.mask(goal))

    @property
    def start(self) -> Joints:
        """Where the arm was at the beginning, rad."""
        return _joints(self.states[0])

    def limits_of(self, arm: Limits) -> Limits:
        """An arm's limits, with as much in one command as the domain's world allows."""
        step = MAX_JOINT_STEP if HAND_OF_FORCES in self.domain.types else MAX_STEP
        return replace(arm, step=step)


def read_recorded_motion(path: Path, namespace: str | None = None) -> RecordedMotion:
    """The motion of the newest episode of an ensemble in a bag.

    Args:
        path: Folder of the bag, or a single file of it.
        namespace: Namespace of the ensemble; None for the only one.

    Raises:
        DamagedBagError: It breaks off, or lacks a state: half a plan is none for a robot.
        InvalidParameterError: There is no such ensemble, or several to choose from; its domain has
            no Panda, or it begins with something in the hand.
        ForeignBagError, UnknownDomainError, InvalidStateError: As for any replay.
    """
    bag = read_bag(path)
    recording = Recording.of(bag, namespace)
    domain = recording.domain()
    if bag.damage is not None or domain is None:
        reason = bag.damage or "it does not name its domain"
        raise DamagedBagError(f"{path} is not to be executed: {reason}")
    if not {ROBOT, HAND_OF_FORCES} & set(domain.types):
        raise InvalidParameterError(f"{domain.name} has no Panda, which a real robot is here")
    moved = [episode for _, episode in sorted(recording.episodes.items()) if episode.states]
    if not moved or moved[-1].task is None:
        raise DamagedBagError(f"{path} has no task with states, so there is nothing to execute")
    episode, task = moved[-1], moved[-1].task
    states = tuple(_states(episode, domain))
    if _holds(states[0]):
        raise InvalidParameterError(
            f"{path} begins with something in the hand, which cannot be put there just so"
        )
    goal = decode_goal(task.goal, domain.atom_space(states[0]))
    return RecordedMotion.of(domain, task.seed, task.index, states, goal)


def _states(episode: RecordedEpisode, domain: Domain) -> Iterator[State]:
    for number, step in enumerate(sorted(episode.states)):
        if step != number:
            raise DamagedBagError(f"the state of step {number} is not in the bag")
        yield decode_state(episode.states[step], domain.types_by_name)


def _waypoints(states: Sequence[State]) -> Iterator[RecordedWaypoint]:
    holding = _holds(states[0])
    for step, state in enumerate(states[1:], start=1):
        held, holding = holding, _holds(state)
        gripper = (
            GripperAction.KEEP
            if held == holding
            else GripperAction.CLOSE
            if holding
            else GripperAction.OPEN
        )
        gap = 2.0 * float(state.get(_robot(state), "finger")) if holding else 0.0
        yield RecordedWaypoint(step, _joints(state), gripper, gap)


def _pressing(states: Sequence[State]) -> Iterator[RecordedWaypoint]:
    """Waypoints of a hand that acts by forces, whose fingers take some steps to close.

    A robot's fingers close while its arm stands. So they do where those of the recording have met
    something: until then, the hand may still come down. They open where they were told to.
    """
    told = [float(state.get(_robot(state), GRIPPER.name)) > 0.0 for state in states]
    acts, gap = {}, 0.0
    for step, (before, now) in enumerate(pairwise(told), start=1):
        if before and not now:
            acts[step] = GripperAction.OPEN, 0.0
        elif now and not before:
            opened = next((k for k in range(step, len(told)) if not told[k]), len(told))
            met = next((k for k in range(step, opened) if _holds(states[k])), None)
            stopped = _stopped(states, step, opened) if met is None else met
            closes = min(stopped + 1, opened - 1)
            acts[closes] = GripperAction.CLOSE, 0.0 if met is None else _gap(states[met])
    for step, state in enumerate(states[1:], start=1):
        action, gap = acts.get(step, (GripperAction.KEEP, gap))
        yield RecordedWaypoint(step, _joints(state), action, gap)


def _stopped(states: Sequence[State], closing: int, opened: int) -> int:
    """The step in which fingers that hold nothing have closed: around a handle, or altogether."""
    ways = (_gap(states[k - 1]) - _gap(states[k]) for k in range(closing + 1, opened))
    return next((closing + i for i, way in enumerate(ways, start=1) if way < STOPS), opened - 1)


def _gap(state: State) -> float:
    """Distance between the fingers, m."""
    return sum(float(state.get(_robot(state), f"{side}_finger")) for side in ("left", "right"))


def _holds(state: State) -> bool:
    return any(state.get(o, "held") > 0.5 for o in state.objects if "held" in o.type.column)


def _joints(state: State) -> Joints:
    robot = _robot(state)
    return tuple(float(state.get(robot, feature.name)) for feature in JOINT_FEATURES)


def _robot(state: State) -> Object:
    (robot,) = (*state.layout.of_type(ROBOT), *state.layout.of_type(HAND_OF_FORCES))
    return robot
