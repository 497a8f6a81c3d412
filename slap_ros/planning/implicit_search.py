# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A* through an abstract graph that is never made, for what it proves where that is too large.

The options that are applicable in a vertex wait in the queue, each with the bound of its skill from
the low-level state and the least steps from where it leads; one is rolled out when it is the best.
So the order of the best entry is a bound of every plan, at any time. It rises fast at first, since
skills know more of a state than of any state.

Where it is known to which abstract states shortcuts lead (:mod:`~slap_ros.planning.shortcut_ends`),
they wait as well, and the next attempt of one waits when one has succeeded. Elsewhere, and of those
that were given up, an entry for all of them waits with the bound of what is to come, and nothing is
proven beyond it.

Where a plan is good enough that is near the shortest, the search is for both: in turns, the entry
of the least bound is taken, which proves, and the one from which the shortest plan is expected
(in the manner of J. Thayer, W. Ruml: Bounded Suboptimal Search: A Direct Approach Using
Inadmissible Estimates, IJCAI 2011). What is to come is expected to exceed its bound as much as a
plan that is just good enough, by what is proven so far, exceeds the bound of the start.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import count
from typing import Any

from slap_ros.planning.model import Model
from slap_ros.planning.options import Option
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.planning.problem import GroundedOptions
from slap_ros.planning.shortcut_ends import ShortcutEnd
from slap_ros.relational import State


@dataclass(frozen=True)
class _PlanPrefix:
    """How a vertex was reached: the last edge, and those before it; None before the first."""

    edge: PlanEdge
    before: _PlanPrefix | None

    def plan(self) -> Plan:
        """The plan that leads there."""
        edges, way = [self.edge], self.before
        while way is not None:
            edges.append(way.edge)
            way = way.before
        return Plan(tuple(reversed(edges)))


@dataclass(order=True)
class _Entry:
    """A vertex, an option out of one, or all shortcuts out of one."""

    f: int  # environment steps of any plan through it, at least
    minus_g: int  # of equal ones, the one that is farther first
    turn: int
    options: int = field(compare=False)  # operators from the start to where it leads, at most
    abstract: int = field(compare=False)  # where it leads, a mask
    state: State = field(compare=False)  # of the vertex
    option: Option | None = field(compare=False, default=None)
    is_open: bool = field(compare=False, default=False)  # whether nothing more is known of it
    to_come: int = field(compare=False, default=0)  # environment steps from where it leads
    way: _PlanPrefix | None = field(compare=False, default=None)  # to the vertex
    is_taken: bool = field(compare=False, default=False)  # by a search for plans

    def expected(self, ratio: float) -> float:
        """Environment steps of a plan through it, where its bound of those to come is too low.

        Args:
            ratio: Steps that it takes to the goal from where it leads, for each of the bound.
        """
        return self.f + (ratio - 1.0) * self.to_come


class ImplicitSearch:
    """The search from one state; it can be continued."""

    def __init__(
        self,
        model: Model,
        operators: GroundedOptions,
        goal: int,
        steps_to_come: Callable[[int, int], int | None],
        shortcut_ends: Callable[[int, int], Sequence[ShortcutEnd] | None] | None,
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
            shortcut_ends: Function from an abstract state, and a number of operators before it, to
                the ends of shortcuts that begin there; None where that is not known. None, in the
                place of the function, for pure planning.
            most_states: Largest number of abstract states, each with the options before it, of
                which the search asks what is to come.
        """
        self._model, self._operators, self._goal = model, operators, goal
        self._steps_to_come = cache(steps_to_come)
        self._shortcut_ends, self._most_states = shortcut_ends, most_states
        self._start = 0  # abstract state
        self._queue: list[_Entry] = []
        self._promising: list[tuple[float, int, _Entry]] = []  # the same entries, while plans count
        self._below = 0  # environment steps that a plan must stay below; 0 while none is looked for
        self._ratio = 0.0  # see _Entry.expected; 0 before a search for plans
        self._proofs, self._turns_of_proofs = count(), 1
        self._turns = count()
        self._queued = 0  # options
        self._proven = 0

    @property
    def _asked(self) -> int:
        """The number of abstract states of which it was asked what is to come."""
        return self._steps_to_come.cache_info().misses

    @property
    def size(self) -> tuple[int, int]:
        """The numbers of abstract states that it knows of and of options that it has queued."""
        return self._asked, self._queued

    def begin(self, state: State) -> None:
        """Put the start into the queue.

        Args:
            state: Low-level state to start from.
        """
        abstract = self._model.space.abstract(state)
        heapq.heappush(self._queue, _Entry(0, 0, next(self._turns), 0, abstract, state))
        self._start = abstract

    def at_least(self, rollouts: int, enough: int) -> int:
        """Environment steps that every plan takes.

        Args:
            rollouts: Number of the model's roll-outs, all of its life, at which the search stops.
            enough: Environment steps of which no more need be proven.
        """
        while self._prove_more(rollouts, enough):
            pass
        return self._proven

    def shorter(self, below: int, within: float, rollouts: int) -> Plan | None:
        """Search for a plan, and for a proof that a known one is good enough, in turns.

        Args:
            below: Environment steps of the known plan; those found are shorter.
            within: How many times as long as the shortest a plan may be.
            rollouts: See :meth:`at_least`.

        Returns:
            A plan that is shorter; None where the known one is good enough, or the limits are
            reached: :meth:`at_least` says what is proven by then.
        """
        self._below, self._ratio, found = below, 0.0, None
        while found is None and self._prove_more(rollouts, math.ceil(below / within)):
            if next(self._proofs) % self._turns_of_proofs == 0:
                self._expect(math.sqrt(below * within * self._proven))
                found = self._try_promising(rollouts)
        self._turns_of_proofs += found is not None
        self._promising, self._below = [], 0
        return self._shortest(below) if found is None else found

    def _expect(self, good_enough: float) -> None:
        """Sort what is promising anew, where more is proven now.

        Args:
            good_enough: Environment steps of a plan that is just good enough.
        """
        ratio = max(1.0, good_enough / (self._steps_to_come(self._start, 0) or 1))
        if ratio == self._ratio:
            return
        self._ratio = ratio
        self._promising = [
            (one.expected(ratio), one.turn, one) for one in self._queue if not one.is_taken
        ]
        heapq.heapify(self._promising)

    def _shortest(self, below: int) -> Plan | None:
        """The best entry as a plan, where it is one and short enough: none is shorter."""
        best = self._queue[0] if self._queue else None
        is_plan = best is not None and self._is_goal(best) and best.f < below
        return best.way.plan() if best is not None and is_plan and best.way is not None else None

    def _is_goal(self, entry: _Entry) -> bool:
        is_vertex = entry.option is None and not entry.is_open
        return is_vertex and entry.abstract & self._goal == self._goal

    def _prove_more(self, rollouts: int, enough: int) -> bool:
        """Take the best entry; whether it could be taken, and more need be proven."""
        while self._queue and self._queue[0].is_taken:
            heapq.heappop(self._queue)
        if not self._queue:
            return False
        best = self._queue[0]
        self._proven = max(self._proven, best.f)
        if self._is_goal(best) or best.is_open or best.f >= enough:
            return False
        if not self._may_take(best, rollouts):
            return False
        self._take(heapq.heappop(self._queue))
        return True

    def _try_promising(self, rollouts: int) -> Plan | None:
        """Take the entries that most probably lead to a shorter plan, until one is rolled out.

        Returns:
            The plan, where one of them is its end.
        """
        while self._promising:
            *_, entry = heapq.heappop(self._promising)
            if entry.is_taken or entry.is_open or entry.f >= self._below:
                continue
            if self._is_goal(entry):
                return entry.way.plan() if entry.way is not None else None
            if not self._may_take(entry, rollouts):
                return None
            self._take(entry)
            if entry.option is not None:
                return None
        return None

    def _may_take(self, entry: _Entry, rollouts: int) -> bool:
        """Whether the limits allow for what an entry takes."""
        if entry.option is None:
            return self._asked < self._most_states
        return self._model.executed < rollouts

    def _take(self, entry: _Entry) -> None:
        """Queue what comes of an entry."""
        entry.is_taken = True
        if entry.option is None:
            self._expand(entry)
        else:
            self._roll_out(entry, entry.option)

    def _expand(self, vertex: _Entry) -> None:
        """Queue what can be done in a vertex, each option with its bound."""
        if self._shortcut_ends is not None:
            self._queue_shortcuts(vertex, self._shortcut_ends(vertex.abstract, vertex.options))
        before = self._before(vertex)
        for ground, option in self._operators:
            if ground.applicable(vertex.abstract):
                reached = ground.apply(vertex.abstract)
                if reached not in before:
                    self._queue_option(vertex, option, reached, vertex.options + 1)

    def _before(self, vertex: _Entry) -> set[int]:
        """The abstract states on the way to a vertex: no forward edges lead to one of them again.

        Not looked for in pure planning, where the depth of the graph says as much.
        """
        before: set[int] = set()
        way = vertex.way if self._shortcut_ends is not None else None
        while way is not None:
            before |= {self._start, way.edge.target.required}
            way = way.before
        return before

    def _queue_shortcuts(self, vertex: _Entry, ends: Sequence[ShortcutEnd] | None) -> None:
        """Queue the shortcuts out of a vertex, as one entry where their ends are not known."""
        if ends is None:
            by_shortcut = self._steps_to_come(vertex.abstract, vertex.options) or 0
            self._put_after(vertex, by_shortcut - vertex.minus_g, is_open=True)
        for end in ends or ():
            self._queue_option(vertex, end.option, end.abstract, end.depth)

    def _queue_option(self, vertex: _Entry, option: Option, reached: int, options: int) -> None:
        """Queue an option with its bound, unless no plan is through it.

        Args:
            vertex: Where it would begin.
            option: What would be done.
            reached: Abstract state that it would lead to, a mask.
            options: Number of operators from the start to there, at most.
        """
        to_come = self._steps_to_come(reached, options)
        if to_come is not None:
            f = option.least_steps(vertex.state) + to_come - vertex.minus_g
            leads = {"abstract": reached, "options": options, "to_come": to_come}
            self._put_after(vertex, f, option=option, **leads)
            self._queued += 1

    def _roll_out(self, entry: _Entry, option: Option) -> None:
        """Queue where an option leads; where it fails, no plan is through it.

        A shortcut that was given up is not tried, so that nothing is known beyond it.
        """
        if option.given_up():
            self._put_after(entry, entry.f, option=None, is_open=True)
            return
        target = option.target(entry.abstract)
        rollout = self._model.roll_out(option, entry.state, target)
        if not rollout.reached:
            return
        to_come = self._steps_to_come(entry.abstract, entry.options) or 0
        minus_g = entry.minus_g - rollout.steps
        way = _PlanPrefix(PlanEdge(option, target, rollout.steps), entry.way)
        reached = {"minus_g": minus_g, "state": rollout.final, "option": None, "way": way}
        self._put_after(entry, to_come - minus_g, **reached)
        following = option.next_attempt()
        if following is not None:  # it takes as long or longer, and ends in another state
            self._put_after(entry, to_come - minus_g, option=following)

    def _put_after(self, entry: _Entry, f: int, **changes: Any) -> None:
        """Queue what comes of an entry; what was proven of that holds for it as well."""
        turn = next(self._turns)
        new = replace(entry, f=max(f, entry.f), turn=turn, is_taken=False, **changes)
        heapq.heappush(self._queue, new)
        if new.f < self._below:
            heapq.heappush(self._promising, (new.expected(self._ratio), turn, new))
