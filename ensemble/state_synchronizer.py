# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States paired with the atoms that hold in them, as message_filters pairs messages by stamp."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from slap_msgs.msg import AbstractState, ObjectCentricState

from ensemble.episode_tracker import EpisodeTracker, subscribe
from ensemble.futures import node_time_s, wait_until
from ensemble.interfaces import ATOMS, STATE
from ensemble.observation import Episode, Observation
from slap_ros.errors import SlapError
from slap_ros.messages.decode import decode_atoms, decode_seen, decode_state, stamp_ns


class StateSynchronizer:
    """Pairs states with the atoms of the same step, and reports each pair newer than the last."""

    def __init__(
        self,
        node: Node,
        on_observation: Callable[[Observation], None],
        on_episode: Callable[[Episode], None] = lambda _: None,
    ) -> None:
        """Subscribe to task, state and atoms.

        Args:
            node: Who subscribes.
            on_observation: Called with each observation that is newer than the last.
            on_episode: Called with each new episode, before its first observation.
        """
        self.latest: Observation | None = None
        self._node = node
        self._on_observation = on_observation
        self._on_episode = on_episode
        self._state: ObjectCentricState | None = None
        self._atoms: AbstractState | None = None
        self._episodes = EpisodeTracker(node, self._open)
        subscribe(node, STATE, self._on_state)
        subscribe(node, ATOMS, self._on_atoms)

    @property
    def episode(self) -> Episode | None:
        """The current episode, once known."""
        return self._episodes.current

    async def observe(
        self, episode: int, timeout_s: float, missing: type[SlapError]
    ) -> Observation:
        """The newest observation, waited for until there is one of this episode or a later one.

        A client that has just reset the world may know of the new episode before this node does.

        Args:
            episode: The number of the episode; 0: any.
            timeout_s: How long to wait, s of the node's time.
            missing: The error to raise where no such observation comes in time.

        Returns:
            An observation of this episode, or of a later one.

        Raises:
            SlapError: ``missing``.
        """
        deadline = node_time_s(self._node) + timeout_s

        def seen() -> bool:
            return self.latest is not None and self.latest.episode.number >= episode

        await wait_until(self._node, lambda: seen() or node_time_s(self._node) > deadline)
        if self.latest is None or not seen():
            raise missing(
                f"no perceived state{f' of episode {episode}' if episode else ''} within "
                f"{timeout_s} s: are sim_node (or robot_bridge) and perception_node running?"
            )
        return self.latest

    def _open(self, episode: Episode) -> None:
        self._on_episode(episode)
        self._pair()

    def _on_state(self, message: ObjectCentricState) -> None:
        if not _is_late(message, self._state):
            self._state = message
            self._pair()

    def _on_atoms(self, message: AbstractState) -> None:
        if not _is_late(message, self._atoms):
            self._atoms = message
            self._pair()

    def _pair(self) -> None:
        episode, state, atoms = self._episodes.current, self._state, self._atoms
        if episode is None or state is None or atoms is None:
            return
        if (state.episode, state.step) != (atoms.episode, atoms.step):
            return
        if not episode.has(state):
            return
        known = self.latest
        if known is not None and known.episode is episode and state.step <= known.step:
            return
        self.latest = Observation(
            episode,
            state.step,
            decode_seen(atoms.seen, decode_state(state, episode.domain.types_by_name)),
            decode_atoms(atoms.atoms, episode.space),
            frozenset(atoms.missing),
            bool(atoms.exact),
        )
        self._on_observation(self.latest)


def _is_late(
    message: ObjectCentricState | AbstractState, newest: ObjectCentricState | AbstractState | None
) -> bool:
    """Whether the message is older than what is known: it was sent again, or overtaken."""
    return newest is not None and stamp_ns(message.header) < stamp_ns(newest.header)
