# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pushes in a bag: moments in which things slide that the hand does not hold.

Each is a few steps long. From the state in which it begins, everything is as it was recorded, so
that a model is judged by what it makes of these steps, and not by what it made of all before them:
after many steps of contact, a little less friction may turn a block another way, and no coefficient
is nearly right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slap_ros.bags.reader import read_bag
from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.bags.taken_commands import taken_commands
from slap_ros.core import Action, Domain
from slap_ros.errors import DamagedBagError, InvalidParameterError
from slap_ros.messages.decode import decode_state
from slap_ros.relational import Layout, Object, State
from slap_ros.relational.state import Array

MATERIAL = ("mass", "friction")  # features of what may be of another material
STEPS = 3  # environment steps of a push
FAR_M = 0.005  # along the ground, in these steps, at least
LEVEL_M = 0.001  # by which a thing's height may change in these steps: more is to fall or to tilt
FEWEST = 5  # pushes from which something may be told
Places = NDArray[np.float64]  # m, shape (steps, things, 3)


@dataclass(frozen=True)
class RecordedPush:
    """A few steps of an episode in which things slid.

    Args:
        states: Recorded states, one more than actions.
        actions: Actions that were taken.
        pushed: Things that slid along what they lie on.
    """

    states: tuple[State, ...]
    actions: tuple[Action, ...]
    pushed: tuple[Object, ...]

    def places(self, states: Sequence[State]) -> Array:
        """Where the pushed things are along the ground, m, shape (states, pushed, 2)."""
        layout = self.states[0].layout
        columns = [[layout.column(obj, axis) for axis in "xy"] for obj in self.pushed]
        return np.stack([state.data[columns] for state in states])


@dataclass(frozen=True)
class PushedRecording:
    """A bag with what was pushed in it.

    Args:
        domain: Domain that was recorded.
        pushes: Pushes in the bag, in the order of time.
        damage: What cannot be read of the bag, and why; None where all of it can be.
    """

    domain: Domain
    pushes: tuple[RecordedPush, ...]
    damage: str | None = None


def read_pushes(path: Path, namespace: str | None = None) -> PushedRecording:
    """The pushes in a bag of one ensemble.

    Args:
        path: Folder of the bag, or a single file of it.
        namespace: Namespace of the ensemble; None for the only one.

    Raises:
        DamagedBagError: Nothing in it can be read, or the domain is missing.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble, its things have no friction that could be
            set, a robot was recorded that stops after every step, or hardly anything was pushed.
    """
    bag = read_bag(path)
    recording = Recording.of(bag, namespace)
    domain = recording.domain()
    if domain is None:
        raise DamagedBagError(f"{path} does not name the domain, so there is no model to calibrate")
    _require_friction(domain, path)
    episodes = _episodes(recording, domain)
    pushes = [push for states, actions in episodes for push in find_pushes(states, actions)]
    if len(pushes) < FEWEST:
        raise InvalidParameterError(_too_few(path, domain, recording, len(pushes)))
    return PushedRecording(domain, tuple(pushes), bag.damage)


def _require_friction(domain: Domain, path: Path) -> None:
    if not any(set(MATERIAL) <= set(kind.column) for kind in domain.types):
        raise InvalidParameterError(
            f"{path} is of {domain.name}, whose things have no mass and friction that could be set"
        )
    if domain.make_model is not None:
        raise InvalidParameterError(
            f"{path} is of {domain.name}, preset {domain.preset}, in which planners take every "
            "thing for the same material and noise disturbs pushes; record pushes without them"
        )
    if domain.is_measured:
        raise InvalidParameterError(
            f"{path} was recorded on a robot, which stands still after every step: things never "
            "slide on by themselves, and only that tells friction; give a recording of a "
            "simulation, in which the arm does not stop between steps"
        )


def _too_few(path: Path, domain: Domain, recording: Recording, pushes: int) -> str:
    """What a bag lacks in which hardly anything was pushed."""
    states = sum(len(one.states) for one in recording.episodes.values())
    commands = sum(len(one.commands) for one in recording.episodes.values())
    if not states or not commands:
        return f"{path} has {states} states and commands of {commands} steps: a push needs both"
    return (
        f"{path} has {pushes or 'no'} pushes, too few: in {states} states of {domain.name}, things "
        f"that the hand did not hold have to slide by {1e3 * FAR_M:g} mm within {STEPS} steps, "
        f"without falling, {FEWEST} times at least; record runs in which the hand pushes things, "
        "such as those with shortcuts"
    )


def _episodes(
    recording: Recording, domain: Domain
) -> Iterator[tuple[tuple[State, ...], tuple[Action, ...]]]:
    """States and actions of every stretch of steps of which nothing is missing."""
    for _, episode in sorted(recording.episodes.items()):
        yield from _stretches(episode, domain)


def _stretches(
    episode: RecordedEpisode, domain: Domain
) -> Iterator[tuple[tuple[State, ...], tuple[Action, ...]]]:
    types = domain.types_by_name
    states = {step: decode_state(msg, types) for step, msg in episode.states.items()}
    taken = taken_commands(domain, states, episode.commands)
    begin: int | None = None
    for step in sorted(states):
        begin = step if begin is None else begin
        if step in taken and step + 1 in states:
            continue
        if step > begin:
            steps = range(begin, step)
            yield (*(states[i] for i in steps), states[step]), tuple(taken[i] for i in steps)
        begin = None


def find_pushes(states: Sequence[State], actions: Sequence[Action]) -> list[RecordedPush]:
    """The pushes in an episode.

    Args:
        states: States, one more than actions.
        actions: Action of each step.

    Returns:
        Every few steps, one after the other and overlapping, in which something slid that was not
        held. Where anything falls or tilts meanwhile, they are left out: how things tumble says
        little of friction, and is another thing in every engine.
    """
    things = _things(states[0].layout)
    if not things:
        return []
    places, held = _places(states, things), _held(states, things)
    found = []
    for begin in range(len(actions) - STEPS + 1):
        end = begin + STEPS
        loose = ~held[begin : end + 1].any(axis=0)
        change = places[begin : end + 1] - places[begin]
        far = np.linalg.norm(change[-1, :, :2], axis=-1) >= FAR_M
        level = (np.abs(change[..., 2]) <= LEVEL_M).all(axis=0)
        if (far & loose).any() and level[loose].all():
            pushed = tuple(obj for obj, yes in zip(things, far & loose, strict=True) if yes)
            found.append(
                RecordedPush(tuple(states[begin : end + 1]), tuple(actions[begin:end]), pushed)
            )
    return found


def _things(layout: Layout) -> list[Object]:
    """What can be pushed and may be of another material."""
    return [obj for obj in layout.objects if {*MATERIAL, "held", "z"} <= set(obj.type.column)]


def _places(states: Sequence[State], things: Sequence[Object]) -> Places:
    layout = states[0].layout
    columns = [[layout.column(obj, axis) for axis in "xyz"] for obj in things]
    return np.stack([state.data[columns] for state in states])


def _held(states: Sequence[State], things: Sequence[Object]) -> NDArray[np.bool_]:
    layout = states[0].layout
    columns = [layout.column(obj, "held") for obj in things]
    return np.stack([state.data[columns] > 0.5 for state in states])
