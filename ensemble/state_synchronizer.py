# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States paired with the atoms that hold in them, as message_filters pairs messages by stamp."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from time import monotonic
from typing import NamedTuple

from rclpy.node import Node
from slap_msgs.msg import AbstractState, EpisodeFault, ObjectCentricState

from ensemble.common_parameters import DEFAULTS, CommonParameters
from ensemble.early_messages import EarlyMessages
from ensemble.endpoints import subscribe
from ensemble.episode_tracker import EpisodeTracker
from ensemble.futures import wait_until
from ensemble.interfaces import ATOMS, FAULT, STATE
from ensemble.observation import Episode, Observation
from ensemble.patience import load_advice
from ensemble.refusals import Refusals
from ensemble.waiting_room import WaitingRoom, key_of
from slap_ros.errors import SlapError
from slap_ros.messages.decode import (
    decode_atoms,
    decode_fault,
    decode_missing,
    decode_seen,
    decode_state,
    stamp_ns,
)
from slap_ros.perception.percept import known_part

WAITING = 1000  # messages of each kind that wait for their counterpart, or for their episode


class Pair(NamedTuple):
    """A state and the atoms that hold in it."""

    state: ObjectCentricState
    atoms: AbstractState


class Rooms:
    """Where states and atoms wait for one another."""

    def __init__(self) -> None:
        self.states: WaitingRoom[ObjectCentricState] = WaitingRoom(WAITING)
        self.atoms: WaitingRoom[AbstractState] = WaitingRoom(WAITING)

    def drop_through(self, step: int) -> None:
        """Let nothing wait any longer that is of this step or of one before."""
        self.states.drop_through(step)
        self.atoms.drop_through(step)


class StateSynchronizer:
    """Pairs states with the atoms of the same step, and reports each pair newer than the last.

    Within an episode, the order is that of the steps. A new episode begins from nothing. The
    current episode, each whose task is here and all others have rooms of their own for what waits:
    whoever sends messages of other episodes cannot take the room of this one.
    """

    def __init__(
        self,
        node: Node,
        on_observation: Callable[[Observation], None],
        prepare: Callable[[Episode], None] = lambda _: None,
        common: CommonParameters = DEFAULTS,
    ) -> None:
        """Subscribe to task, state and atoms.

        Args:
            node: Node that subscribes.
            on_observation: Called with each observation that is newer than the last.
            prepare: Called in a thread for each new episode, before its first observation.
            common: Parameters of the node, see :class:`EpisodeTracker`.
        """
        self.latest: Observation | None = None
        self._node = node
        self._on_observation = on_observation
        self._refusals = Refusals(node)
        self._current, self._expected, self._others = Rooms(), Rooms(), Rooms()
        self._early_faults: OrderedDict[tuple[int, int], EpisodeFault] = OrderedDict()
        self._fault: EpisodeFault | None = None  # of the current episode
        self._unstarted: EpisodeFault | None = None  # why there is no first episode
        self._episodes = EpisodeTracker(node, prepare, self._open, self._refusals, common)
        self._early: EarlyMessages[Pair] = EarlyMessages(
            WAITING, lambda pair: pair.state, self._episodes.expects
        )
        subscribe(node, STATE, self._on_state)
        subscribe(node, ATOMS, self._on_atoms)
        subscribe(node, FAULT, self._on_fault)

    @property
    def episode(self) -> Episode | None:
        """The current episode, once known."""
        return self._episodes.current

    @property
    def counts(self) -> Mapping[str, int]:
        """What was refused, for diagnostics."""
        return self._refusals.counts

    @property
    def failure(self) -> SlapError | None:
        """Why the current episode cannot go on; None if it can."""
        episode, fault = self.episode, self._fault
        if episode is None or fault is None or not episode.is_ended_by(fault):
            return None
        return decode_fault(fault)

    def destroy(self) -> None:
        """Stop the thread in which episodes are prepared."""
        self._episodes.destroy()

    async def observe(
        self, episode: int, timeout_s: float, missing: type[SlapError]
    ) -> Observation:
        """The newest observation, waited for until there is one of this episode or a later one.

        A client that has just reset the world may know of the new episode before this node does.

        Args:
            episode: The number of the episode; 0: any.
            timeout_s: How long to wait, s.
            missing: The error to raise where no such observation comes in time.

        Returns:
            An observation of this episode, or of a later one.

        Raises:
            SlapError: ``missing``, or why the task was refused, or its states cannot be perceived.
            EpisodeChangedError: An earlier episode goes on meanwhile.
        """
        deadline = monotonic() + timeout_s

        def seen() -> bool:
            return self.latest is not None and self.latest.episode.number >= episode

        def unseen_failure() -> SlapError | None:
            current, latest = self.episode, self.latest
            if current is None or current.number < episode:
                return None
            return None if latest and latest.episode is current else self.failure

        await wait_until(self._node, lambda: seen() or unseen_failure() or monotonic() > deadline)
        if failure := unseen_failure():
            raise failure
        if not seen() and self._episodes.refusal is not None:
            raise self._episodes.refusal
        if self.episode is None and self._unstarted is not None:
            raise decode_fault(self._unstarted)
        if self.latest is not None and not seen():
            self.latest.require_episode(episode)
        if self.latest is None:
            raise missing(
                f"no perceived state{f' of episode {episode}' if episode else ''} within "
                f"{timeout_s} s: are sim_node (or robot_bridge) and perception_node running? "
                f"If so, {load_advice()}"
            )
        return self.latest

    def _open(self, episode: Episode, _: None) -> None:
        self._current, self._unstarted = Rooms(), None
        self._fault = self._early_faults.get((episode.number, episode.opened_ns))
        assert self._episodes.opened is not None
        if early := self._early.take(episode):
            self._observe(episode, max(early, key=lambda pair: pair.state.step))
        else:  # the task has the first state, should that have been lost
            self._on_state(self._episodes.opened.initial_state)

    def _on_state(self, message: ObjectCentricState) -> None:
        key = key_of(message)
        atoms = next((found for room in self._rooms if (found := room.atoms.pop(key))), None)
        if atoms is not None:
            self._take(Pair(message, atoms))
        elif self._is_of_use(message) and self._fits(message):
            self._room_of(message).states.add(message)

    def _on_atoms(self, message: AbstractState) -> None:
        key = key_of(message)
        state = next((found for room in self._rooms if (found := room.states.pop(key))), None)
        if state is not None:
            self._take(Pair(state, message))
        elif self._is_of_use(message):
            self._room_of(message).atoms.add(message)

    @property
    def _rooms(self) -> tuple[Rooms, Rooms, Rooms]:
        return self._current, self._expected, self._others

    def _room_of(self, message: ObjectCentricState | AbstractState) -> Rooms:
        """Where a message waits: strangers' do so elsewhere, unless they are of this episode."""
        if self._may_be_current(message):
            return self._current
        return self._expected if self._episodes.expects(message) else self._others

    def _is_of_use(self, message: ObjectCentricState | AbstractState) -> bool:
        """Whether a message may say something new: not if it is of a step that is known."""
        latest = self.latest
        if latest is None or latest.episode is not self.episode:
            return True
        return not self._may_be_current(message) or message.step > latest.step

    def _may_be_current(self, message: ObjectCentricState | AbstractState) -> bool:
        """Whether a message may be of this episode.

        A simulator that was started again counts episodes from 1, and its first messages may be
        here before its task is opened.
        """
        return self.episode is not None and self.episode.may_have(message)

    def _fits(self, message: ObjectCentricState) -> bool:
        """Whether a state can be one of the current episode, or is one of another."""
        episode = self.episode
        if episode is None or message.episode != episode.number or message.step == 0:
            return True
        return episode.has(message)

    def _on_fault(self, message: EpisodeFault) -> None:
        if self.episode is not None and self.episode.is_ended_by(message):
            self._fault = message
            return
        if not message.episode:
            self._unstarted = message
            return
        self._early_faults[message.episode, stamp_ns(message.header)] = message
        if len(self._early_faults) > WAITING:
            self._early_faults.popitem(last=False)

    def _take(self, pair: Pair) -> None:
        episode, known = self._episodes.current, self.latest
        if episode is None or not episode.has(pair.state):
            self._early.add(pair)
        elif known is None or known.episode is not episode or pair.state.step > known.step:
            self._observe(episode, pair)

    def _observe(self, episode: Episode, pair: Pair) -> None:
        try:
            self.latest = _decoded(episode, pair)
        except SlapError as error:
            self._refusals.add("refused_states", f"step {pair.state.step} refused: {error}")
        else:
            self._current.drop_through(self.latest.step)
            self._on_observation(self.latest)


def _decoded(episode: Episode, pair: Pair) -> Observation:
    state, atoms = pair
    whole = decode_seen(atoms.seen, decode_state(state, episode.domain.types_by_name))
    missing = decode_missing(atoms.missing, whole)
    return Observation(
        episode,
        state.step,
        known_part(whole, missing),
        decode_atoms(atoms.atoms, episode.space),
        missing,
        bool(atoms.exact),
    )
