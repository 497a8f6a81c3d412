# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds of which half are in another process, so that two cores step them.

The next states are the same wherever they are computed. Whole environments in other processes are
:mod:`slap_ros.learning.subproc_vec_env`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from multiprocessing.connection import Connection

import numpy as np

from slap_ros.core import Domain, MakeVectorWorld, VectorWorld
from slap_ros.learning.linked_process import linked_process, receive, send
from slap_ros.relational import State
from slap_ros.relational.state import Array


@contextmanager
def divided_worlds(domain: Domain, make_domain: Callable[[], Domain]) -> Iterator[MakeVectorWorld]:
    """Yield the function that makes divided worlds, as long as the other process runs.

    Args:
        domain: Domain of the worlds.
        make_domain: Function that makes the same domain in the other process; importable by its
            name.
    """
    numbers = count()

    def make(states: Sequence[State]) -> VectorWorld:
        half = (len(states) + 1) // 2
        here, there = states[:half], states[half:]
        if not there:
            return domain.make_vector_world(here)
        number = next(numbers)  # the other process counts them too, whatever becomes of those here
        send(link, _Made(there))
        return _DividedWorlds(domain.make_vector_world(here), there, link, number)

    with linked_process(_serve, make_domain) as link:
        yield make


class _DividedWorlds:
    """The first of several worlds here, the others at the other end of a link."""

    def __init__(
        self, here: VectorWorld, there: Sequence[State], link: Connection, number: int
    ) -> None:
        """Join the worlds of both processes.

        Args:
            here: First worlds, in this process.
            there: States of the other worlds.
            link: Connection to the process that has the other worlds.
            number: Number under which that process knows the other worlds.
        """
        self._here, self._link, self._number = here, link, number
        self._layout = here.states.layout
        self._count = len(here.states.data)
        self._others = np.stack([state.data for state in there])

    @property
    def states(self) -> State:
        """See :class:`VectorWorld`."""
        return self._joined(self._here.states)

    def reset(self, world: int, state: State) -> None:
        """See :class:`VectorWorld`; what the other process refuses, the next step raises."""
        if world < self._count:
            self._here.reset(world, state)
            return
        other = world - self._count
        self._others[other] = state.data
        send(self._link, _Reset(self._number, other, state))

    def step(self, actions: Array) -> State:
        """See :class:`VectorWorld`.

        Raises:
            ChildProcessError: The other process has ended.
        """
        send(self._link, _Stepped(self._number, actions[self._count :]))
        here = self._here.step(actions[: self._count])
        self._others = receive(self._link)
        return self._joined(here)

    def _joined(self, here: State) -> State:
        return State(self._layout, np.concatenate([here.data, self._others]))


@dataclass(frozen=True)
class _Made:
    """Asks the other process for worlds, one in each of these states; it numbers them."""

    states: Sequence[State]


@dataclass(frozen=True)
class _Reset:
    """Lets one of the worlds of a number continue from a state."""

    number: int
    world: int
    state: State


@dataclass(frozen=True)
class _Stepped:
    """Steps the worlds of a number; their states are the answer."""

    number: int
    actions: Array


def _serve(link: Connection, make_domain: Callable[[], Domain]) -> None:
    """Serve the other process's worlds until the link is closed."""
    domain, worlds = make_domain(), list[VectorWorld]()
    while True:
        match link.recv():
            case _Made(states):
                worlds.append(domain.make_vector_world(states))
            case _Reset(number, world, state):
                worlds[number].reset(world, state)
            case _Stepped(number, actions):
                link.send(worlds[number].step(actions).data)
