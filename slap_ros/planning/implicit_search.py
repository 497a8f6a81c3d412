# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A* through an abstract graph that is never made: for what it proves, where the graph is too large.

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
from dataclasses import dataclass, field
from functools import cache
from itertools import count

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
        least_steps: Callable[[int], int | None],
        shortcuts_may_begin: Callable[[int], bool],
    ) -> None:
        """Prepare the search.

        Args:
            model: Model that rolls options out.
            operators: Operators with their options.
            goal: Mask of atoms that must hold.
            least_steps: Function from an abstract state to environment steps to the goal at least,
                shortcuts included; None where the goal is out of reach.
            shortcuts_may_begin: Function that says whether a shortcut may begin in an abstract
                state.
        """
        self._model, self._operators, self._goal = model, operators, goal
        self._least_steps = cache(least_steps)
        self._shortcuts_may_begin = shortcuts_may_begin
        self._queue: list[_Entry] = []
        self._turns = count()
        self._proven = 0

    def begin(self, state: State) -> None:
        """Put the start into the queue.

        Args:
            state: Low-level state to start from.
        """
        self._put(0, 0, self._model.space.abstract(state), state)

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
            if best.option is None:
                heapq.heappop(self._queue)
                self._expand(best)
            elif self._model.executed < rollouts:
                heapq.heappop(self._queue)
                self._roll_out(best, best.option)
            else:
                break
        return self._proven

    def _put(
        self, f: int, g: int, abstract: int, state: State, option: Option | None = None
    ) -> None:
        heapq.heappush(self._queue, _Entry(f, -g, next(self._turns), abstract, state, option))

    def _expand(self, vertex: _Entry) -> None:
        """Queue what can be done in a vertex, each option with its bound."""
        g, state, abstract = -vertex.minus_g, vertex.state, vertex.abstract
        if self._shortcuts_may_begin(abstract):
            f = max(vertex.f, g + (self._least_steps(abstract) or 0))
            heapq.heappush(
                self._queue, _Entry(f, -g, next(self._turns), abstract, state, is_open=True)
            )
        for ground, option in self._operators:
            if not ground.applicable(abstract):
                continue
            reached = ground.apply(abstract)
            to_come = self._least_steps(reached)
            if to_come is not None:
                bound = option.skill.lower_bound(state, option.objects)
                f = g + max(bound, option.skill.least_steps) + to_come
                self._put(max(vertex.f, f), g, reached, state, option)

    def _roll_out(self, entry: _Entry, option: Option) -> None:
        """Queue where an option leads; where it fails, no plan is through it."""
        g, to_come = -entry.minus_g, self._least_steps(entry.abstract) or 0
        rollout = self._model.roll_out(option, entry.state, option.target(entry.abstract))
        if not rollout.reached:
            return
        f = max(entry.f, g + rollout.steps + to_come)
        self._put(f, g + rollout.steps, entry.abstract, rollout.final)
