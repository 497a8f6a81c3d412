# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node knows of the world: the episode, and the newest state with its atoms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rclpy.node import Node
from slap_msgs.msg import AbstractState, DomainInfo, ObjectCentricState
from slap_msgs.msg import Task as TaskMessage

from ensemble.interfaces import ATOMS, DOMAIN, STATE, TASK, Topic
from ensemble.waiting import seconds, until
from slap_ros.core import Domain, Task
from slap_ros.domains import get_domain
from slap_ros.messages.decode import (
    decode_atoms,
    decode_goal,
    decode_seen,
    decode_state,
    stamp_ns,
)
from slap_ros.relational import AtomSpace, State


@dataclass(frozen=True)
class Episode:
    """What stays the same from one reset to the next."""

    number: int  # counts the simulator's resets
    opened_ns: int  # stamp of its task: messages stamped earlier are another episode's
    domain: Domain
    task: Task
    space: AtomSpace

    def follows(self, message: ObjectCentricState) -> bool:
        """Whether this episode was opened after the message was sent."""
        return stamp_ns(message.header) < self.opened_ns

    def has(self, message: ObjectCentricState) -> bool:
        """Whether the message is a state of this episode.

        The number alone would not tell a restarted simulator's first episode from the old one.
        """
        return (
            message.episode == self.number
            and stamp_ns(message.header) >= self.opened_ns
            and [obj.name for obj in message.objects] == [o.name for o in self.space.layout.objects]
        )


@dataclass(frozen=True)
class Observation:
    """A perceived state."""

    episode: Episode
    step: int
    state: State
    abstract: int
    missing: frozenset[str] = frozenset()  # objects of which nobody knows where they are
    exact: bool = True  # whether another look would find the same


def subscribe(node: Node, topic: Topic, callback: Callable[..., None]) -> None:
    """Subscribe with the topic's own QoS."""
    node.create_subscription(topic.type, topic.name, callback, topic.qos)


class EpisodeWatcher:
    """Follows ``domain`` and ``task``, which may arrive in either order.

    Raises out of the callbacks, and so out of ``spin``:
        UnknownDomainError: The simulator runs a domain that is not installed here.
    """

    def __init__(self, node: Node, on_episode: Callable[[Episode], None]) -> None:
        """``on_episode`` is called for each new episode."""
        self.current: Episode | None = None
        self._on_episode = on_episode
        self._domain: DomainInfo | None = None
        self._task: TaskMessage | None = None
        subscribe(node, DOMAIN, self._on_domain)
        subscribe(node, TASK, self._on_task)

    # What is latched comes again after two nodes had lost sight of each other for a moment. That
    # is no new episode.

    def _on_domain(self, message: DomainInfo) -> None:
        if message != self._domain:
            self._domain = message
            self._open()

    def _on_task(self, message: TaskMessage) -> None:
        if message != self._task:
            self._task = message
            self._open()

    def _open(self) -> None:
        if self._domain is None or self._task is None or self._domain.name != self._task.domain:
            return
        domain = get_domain(self._domain.name, self._domain.preset)
        initial = decode_state(self._task.initial_state, domain.types_by_name)
        space = domain.atom_space(initial)
        goal = decode_goal(self._task.goal, space)
        task = Task(initial, goal, self._task.step_limit)
        opened_ns = stamp_ns(self._task.header)
        self.current = Episode(self._task.episode, opened_ns, domain, task, space)
        self._on_episode(self.current)


class Observer:
    """Pairs states with their atoms and hands on each pair that is newer than the last."""

    def __init__(
        self,
        node: Node,
        on_observation: Callable[[Observation], None],
        on_episode: Callable[[Episode], None] = lambda _: None,
    ) -> None:
        """``on_episode`` is called for each new episode, before its first observation."""
        self.latest: Observation | None = None
        self._node = node
        self._on_observation = on_observation
        self._on_episode = on_episode
        self._state: ObjectCentricState | None = None
        self._atoms: AbstractState | None = None
        self._watcher = EpisodeWatcher(node, self._open)
        subscribe(node, STATE, self._on_state)
        subscribe(node, ATOMS, self._on_atoms)

    @property
    def episode(self) -> Episode | None:
        """The current episode, once known."""
        return self._watcher.current

    async def wait(self, episode: int, timeout_s: float) -> Observation | None:
        """The newest observation, waited for until there is one of this episode or a later one.

        After ``timeout_s`` of the node's time, whatever there is.
        """
        deadline = seconds(self._node) + timeout_s

        def seen() -> bool:
            return self.latest is not None and self.latest.episode.number >= episode

        await until(self._node, lambda: seen() or seconds(self._node) > deadline)
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
        episode, state, atoms = self._watcher.current, self._state, self._atoms
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
