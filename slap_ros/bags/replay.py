# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replay: the recorded commands in a fresh world must give the recorded states, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from slap_ros.bags.ensembles import ROOT
from slap_ros.bags.evaluate import EnsembleContents, read_runs
from slap_ros.bags.recording import RecordedEpisode, initial_state
from slap_ros.core import ActionSpace, Domain, World
from slap_ros.errors import (
    DamagedBagError,
    InvalidCommandError,
    InvalidParameterError,
    InvalidStateError,
)
from slap_ros.messages.decode import decode_command, decode_state
from slap_ros.messages.protocols import CommandMessage
from slap_ros.relational import State


@dataclass(frozen=True)
class Difference:
    """A feature that the replay has otherwise than the recording."""

    episode: int
    step: int
    object: str
    feature: str
    recorded: float  # in the feature's unit
    replayed: float
    namespace: str = ROOT  # of the ensemble


@dataclass
class ReplayResult:
    """How a replay went."""

    compared: int = 0  # states
    different: int = 0  # states that differ in at least one bit
    first: Difference | None = None
    unreached: int = 0  # states that no recorded commands lead to; the replay goes on from them
    damage: str | None = None  # where reading the bag had to stop and why, or what is missing

    @property
    def identical(self) -> bool:
        """Whether there is something to compare, and all of it the same."""
        return self.compared > 0 and self.different == 0


def replay_bag(path: Path | str, namespace: str | None = None) -> ReplayResult:
    """Feed the commands of each episode to a fresh world and compare every state.

    Args:
        path: Folder of the bag, or a single file of it.
        namespace: Namespace of an ensemble; None for all ensembles, one after the other.

    Raises:
        DamagedBagError: Nothing in it can be read, or it breaks off before the domain is named.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble, or its states were measured on a robot.
        UnknownDomainError: Its domain is not known here.
        InvalidStateError: It has a state that its domain or its task cannot have.
    """
    contents = read_runs(path, namespace)
    result = ReplayResult(damage=contents.damage)
    for ensemble in contents.ensembles:
        domain = ensemble.recording.domain()
        if domain is None:
            raise DamagedBagError(
                f"{path} does not name the domain, so there is nothing to replay in"
            )
        if domain.is_measured:
            raise InvalidParameterError(
                f"{path} was recorded on a robot, real or simulated: its states are measured, and "
                "no world repeats them bit for bit. `slap bag evaluate` computes its figures "
                "again, `slap bag replay --to robot --dry-run` checks its motion"
            )
        _replay_ensemble(ensemble, domain, result)
    return result


def _replay_ensemble(ensemble: EnsembleContents, domain: Domain, result: ReplayResult) -> None:
    """Replay the episodes of an ensemble, and add what came of it."""
    for number, episode in sorted(ensemble.recording.episodes.items()):
        if len(episode.states) > 1 and not episode.commands:
            lost = f"the commands of episode {number} are missing"
            result.damage = f"{result.damage}; {lost}" if result.damage else lost
        for step, recorded, replayed in _replay(episode, domain):
            if replayed is None:
                result.unreached += 1
                continue
            result.compared += 1
            if recorded != replayed:
                result.different += 1
                difference = _difference(number, step, recorded, replayed)
                result.first = result.first or replace(difference, namespace=ensemble.namespace)


@dataclass
class _Replay:
    """An episode replayed in a world of its own."""

    world: World
    actions: ActionSpace
    commands: dict[int, list[CommandMessage]] = field(default_factory=dict)

    def advance(self, first: int, last: int, recorded: State) -> State | None:
        """From the state of step ``first`` to that of ``last``; None where commands are missing."""
        for step in range(first, last - 1):
            if not self._step(self.commands.get(step, ()), None):
                return None
        if not self._step(self.commands.get(last - 1, ()), recorded):
            return None
        return self.world.state

    def _step(self, candidates: Sequence[CommandMessage], recorded: State | None) -> bool:
        """Carry out the command that the simulator took.

        The bag has those that it refused, too, and topics from several nodes interleave as they
        arrive. Of those that the world accepts, it is the first that leads to the recorded
        state; where none does, the first is as good as any.
        """
        before = self.world.state
        after: list[State] = []
        for message in candidates:
            if after:
                self.world.reset(before)
            try:
                after.append(self.world.step(decode_command(message, self.actions)))
            except InvalidCommandError:
                continue  # the simulator refused it just so
            if recorded is None or after[-1] == recorded:
                return True
        if len(after) > 1:
            self.world.reset(after[0])
        return bool(after)


def _replay(episode: RecordedEpisode, domain: Domain) -> Iterator[tuple[int, State, State | None]]:
    """Step, recorded and replayed state, for every state of an episode."""
    start = initial_state(episode, domain)
    if start is None:
        return
    current, state = start
    replay = _Replay(domain.make_world(state), domain.action_space, episode.commands)
    types = domain.types_by_name
    for step in sorted(episode.states):
        recorded = decode_state(episode.states[step], types)
        if recorded.layout != state.layout:
            raise InvalidStateError(f"the state of step {step} has other objects than the task")
        replayed = state if step == current else replay.advance(current, step, recorded)
        yield step, recorded, replayed
        if replayed is None:
            replay.world.reset(recorded)
        current, state = step, replay.world.state


def _difference(episode: int, step: int, recorded: State, replayed: State) -> Difference:
    bits = recorded.data.view(np.uint64) != replayed.data.view(np.uint64)
    position = int(np.argmax(bits))
    for obj, part in recorded.layout.slices.items():
        if part.start <= position < part.stop:
            feature = obj.type.features[position - part.start].name
            break
    return Difference(
        episode,
        step,
        obj.name,
        feature,
        float(recorded.data[position]),
        float(replayed.data[position]),
    )
