# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A* through an abstract graph that is never made, for what it proves where that is too large.

The options that are applicable in a vertex wait in the queue, each with the bound of its skill from
the low-level state and the least steps from where it leads; one is rolled out when it is the best.
So the order of the best entry is a bound of every plan, at any time. It rises fast at first, since
skills know more of a state than of any state.

Shortcuts are too many to try: where one may begin, an entry for all of them waits with the bound of
what is to come, and nothing is proven beyond it.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import count
from typing import Any

from slap_ros.planning.model import Model
from slap_ros.planning.options import Option
from slap_ros.planning.problem import GroundedOptions
from slap_ros.relational import State


@dataclass(order=True)
class _Entry:
    """A vertex, an option out of one, or all shortcuts out of one."""

    f: int  # environment steps of any plan through it, at least
    minus_g: int  # of equal ones, the one that is farther first
    turn: int
    options: int = field(compare=False)  # from the start to where it leads
    abstract: int = field(compare=False)  # where it leads, a mask
    state: State = field(compare=False)  # of the vertex
    option: Option | None = field(compare=False, default=None)
    is_open: bool = field(compare=False, default=False)  # whether nothing more is known of it


class ImplicitSearch:
    """The search from one state; it can be continued."""

    def __init__(
        self,
        model: Model,
        operators: GroundedOptions,
        goal: int,
        steps_to_come: Callable[[int, int], int | None],
        shortcuts_may_begin: Callable[[int], bool],
        most_states: int,
    ) -> None:
        """Prepare the search.

        Args:
            model: Model that rolls options out.
            operators: Operators with their options.
            goal: Mask of atoms that must hold.
            steps_to_come: Function from an abstract state, and the number of options before it, to
                environment steps to the goal at least, shortcuts included; None where no plan is
                through it.
            shortcuts_may_begin: Function that says whether a shortcut may begin in an abstract
                state.
            most_states: Largest number of abstract states, each with the options before it, of
                which the search asks what is to come.
        """
        self._model, self._operators, self._goal = model, operators, goal
        self._steps_to_come = cache(steps_to_come)
        self._shortcuts_may_begin, self._most_states = shortcuts_may_begin, most_states
        self._queue: list[_Entry] = []
        self._turns = count()
        self._proven = 0

    @property
    def _asked(self) -> int:
        """The number of abstract states of which it was asked what is to come."""
        return self._steps_to_come.cache_info().misses

    def begin(self, state: State) -> None:
        """Put the start into the queue.

        Args:
            state: Low-level state to start from.
        """
        abstract = self._model.space.abstract(state)
        heapq.heappush(self._queue, _Entry(0, 0, next(self._turns), 0, abstract, state))

    def at_least(self, rollouts: int, enough: int) -> int:
        """Environment steps that every plan takes.

        Args:
            rollouts: Number of the model's roll-outs, all of its life, at which the search stops.
            enough: Environment steps of which no more need be proven.
        """
        while self._queue:
            best = self._queue[0]
            self._proven = best.f
            is_goal = best.option is None and best.abstract & self._goal == self._goal
            if is_goal or best.is_open or best.f >= enough:
                break
            if best.option is None and self._asked < self._most_states:
                self._expand(heapq.heappop(self._queue))
            elif best.option is not None and self._model.executed < rollouts:
                self._roll_out(heapq.heappop(self._queue), best.option)
            else:
                break
        return self._proven

    def _expand(self, vertex: _Entry) -> None:
        """Queue what can be done in a vertex, each option with its bound."""
        if self._shortcuts_may_begin(vertex.abstract):
            by_shortcut = self._steps_to_come(vertex.abstract, vertex.options) or 0
            self._put_after(vertex, by_shortcut - vertex.minus_g, is_open=True)
        for ground, option in self._operators:
            if not ground.applicable(vertex.abstract):
                continue
            reached, options = ground.apply(vertex.abstract), vertex.options + 1
            to_come = self._steps_to_come(reached, options)
            if to_come is not None:
                f = option.least_steps(vertex.state) + to_come - vertex.minus_g
                self._put_after(vertex, f, abstract=reached, options=options, option=option)

    def _roll_out(self, entry: _Entry, option: Option) -> None:
        """Queue where an option leads; where it fails, no plan is through it."""
        rollout = self._model.roll_out(option, entry.state, option.target(entry.abstract))
        if rollout.reached:
            minus_g = entry.minus_g - rollout.steps
            f = (self._steps_to_come(entry.abstract, entry.options) or 0) - minus_g
            self._put_after(entry, f, minus_g=minus_g, state=rollout.final, option=None)

    def _put_after(self, entry: _Entry, f: int, **changes: Any) -> None:
        """Queue what comes of an entry; what was proven of that holds for it as well."""
        turn = next(self._turns)
        heapq.heappush(self._queue, replace(entry, f=max(f, entry.f), turn=turn, **changes))
