# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is proven of any plan, where the abstract graph is too large to be searched.

Landmarks say what any plan costs (:mod:`slap_ros.planning.potential`), and a search that begins in
the start says more (:mod:`slap_ros.planning.implicit_search`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property, reduce
from operator import or_

from slap_ros.core import ProvingSkill, Skill
from slap_ros.planning.graph_depth import GraphDepth
from slap_ros.planning.implicit_search import ImplicitSearch
from slap_ros.planning.landmark_cut import RelaxedOperator
from slap_ros.planning.model import CountedModel
from slap_ros.planning.plan import Plan
from slap_ros.planning.potential import LeastSteps, alternate
from slap_ros.planning.problem import Problem
from slap_ros.planning.shortcut_ends import ShortcutEnd, ShortcutEnds
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.relational import State


class PlanProof:
    """Environment steps that any plan takes from a state to a goal, as far as they are proven."""

    def __init__(
        self,
        problem: Problem,
        shortcuts: ShortcutSource | None,
        state: State,
        goal: int,
        most_states: int,
    ) -> None:
        """Prove nothing yet.

        Args:
            problem: Model and operators. Roll-outs for proofs are counted for themselves.
            shortcuts: Where shortcut edges come from; None for pure planning.
            state: Low-level state from which plans start.
            goal: Mask of atoms that must hold.
            most_states: Largest number of abstract states that the search asks about.
        """
        self._problem, self._shortcuts = problem, shortcuts
        self._state, self._goal, self._most_states = state, goal, most_states
        self._start = problem.model.space.abstract(state)
        self.first_options = 0  # number of options of the plan that the FF heuristic finds
        self._forget_failures = shortcuts.forget_failures_since_now() if shortcuts else _nothing

    def by_landmarks(self) -> int:
        """Environment steps by landmarks of operators and shortcuts alone."""
        return self._steps_from(self._start, 0) or 0

    def by_search(self, rollouts: int, enough: int) -> int:
        """Environment steps by the search, which goes on where it was.

        Args:
            rollouts: Number of roll-outs, those of earlier calls among them, at which it stops.
            enough: Environment steps of which no more need be proven.
        """
        with self._failures_apart():
            return self._search.at_least(rollouts, enough)

    def shorter(self, below: int, within: float, rollouts: int) -> Plan | None:
        """A plan that the search meets, which then looks for plans and proofs in turns.

        Args:
            below: Environment steps of the plan that is known.
            within: How many times as long as the shortest a plan may be.
            rollouts: See :meth:`by_search`.

        Returns:
            A plan that is shorter; None where the known one is good enough, or nothing more is
            found: :meth:`by_search` says what is proven by then.
        """
        with self._failures_apart():
            return self._search.shorter(below, within, rollouts)

    @property
    def size(self) -> tuple[int, int]:
        """The numbers of abstract states and of options that the search has seen."""
        return self._search.size

    @cached_property
    def _search(self) -> ImplicitSearch:
        shortcuts = self._shortcuts
        search = ImplicitSearch(
            CountedModel(self._problem.model),
            self._problem.operators,
            self._goal,
            self._steps_to_come,
            None if shortcuts is None else self._ends_of(shortcuts),
            self._most_states,
        )
        search.begin(self._state)
        return search

    def _ends_of(
        self, shortcuts: ShortcutSource
    ) -> Callable[[int, int], Sequence[ShortcutEnd] | None]:
        depths = GraphDepth(
            self._start,
            self._goal,
            self._problem.grounds,
            self._fewest_options,
            self.first_options,
        )
        return ShortcutEnds(self._problem, shortcuts, self._start, depths).of

    @contextmanager
    def _failures_apart(self) -> Iterator[None]:
        """Let failures of shortcuts in proofs not count in searches for plans, and vice versa."""
        shortcuts = self._shortcuts
        forget_mine = shortcuts.forget_failures_since_now() if shortcuts else _nothing
        self._forget_failures()
        try:
            yield
        finally:
            forget_mine()

    def _steps_to_come(self, abstract: int, options: int) -> int | None:
        """See :class:`ImplicitSearch`."""
        if self._options is not None:
            fewest = self._fewest_options(abstract)
            if fewest is None or options + fewest > self._options:
                return None
        return self._steps_from(abstract, options)

    def _steps_from(self, abstract: int, options: int) -> int | None:
        """Steps of any plan from an abstract state, be it as deep as the graph or not.

        Args:
            abstract: Abstract state, a mask.
            options: Number of options before it.
        """
        least = self._least_steps(abstract)
        return least if options or not least else max(1, least - self._saved_by_first)

    @cached_property
    def _options(self) -> int | None:
        """The number of options of each plan through the graph; None where that is not known.

        Where each option changes whether one atom holds, layers of the graph alternate in it, so
        that each forward edge leads to the next layer. The goal is in the last one.
        """
        if self._shortcuts is not None or not alternate(self._problem.grounds, self._start):
            return None
        fewest = self._fewest_options(self._start)
        return fewest if fewest == self.first_options else None

    @cached_property
    def _fewest_options(self) -> LeastSteps:
        """The number of options from an abstract state to the goal at least."""
        operators = self._relaxed_operators(follows=False)
        return LeastSteps(self._goal, [replace(one, least_steps=1) for one in operators])

    @cached_property
    def _least_steps(self) -> LeastSteps:
        """Steps of plans from an abstract state, by landmarks of operators and shortcuts.

        Without shortcuts, each operator counts as if it came right after another.
        """
        if self._shortcuts is None:
            return LeastSteps(self._goal, self._relaxed_operators(follows=True))
        operators = self._relaxed_operators(follows=False)
        return LeastSteps(self._goal, [*operators, *self._shortcuts.relaxed()])

    @cached_property
    def _saved_by_first(self) -> int:
        """Steps that an operator takes less, at most, where it is the first of a plan."""
        if self._shortcuts is not None:
            return 0
        first, later = (self._relaxed_operators(follows) for follows in (False, True))
        saved = (b.least_steps - a.least_steps for a, b in zip(first, later, strict=True))
        return max(saved, default=0)

    def _relaxed_operators(self, follows: bool) -> list[RelaxedOperator]:
        """The operators with the least steps of their skills, without what always holds.

        Args:
            follows: Whether each comes right after another; see
                :meth:`~slap_ros.core.ProvingSkill.least_steps_in_plans`.
        """
        effects = (one.add_effects | one.delete_effects for one in self._problem.grounds)
        changing = reduce(or_, effects, 0)
        always = self._start & ~changing
        skills = {option.skill.name: option.skill for _, option in self._problem.operators}
        least = {
            name: least_steps_in_plans(skill, self._state, follows)
            for name, skill in skills.items()
        }
        return [
            RelaxedOperator(
                ground.preconditions & ~always,
                ground.add_effects,
                least[option.skill.name],
                ground.delete_effects,
            )
            for ground, option in self._problem.operators
        ]


def least_steps_in_plans(skill: Skill, initial: State, follows: bool) -> int:
    """What any skill takes at least; see :class:`~slap_ros.core.ProvingSkill`.

    Args:
        skill: Given skill.
        initial: State in which plans begin.
        follows: Whether the skill comes right after another.
    """
    if isinstance(skill, ProvingSkill):
        return max(skill.least_steps, skill.least_steps_in_plans(initial, follows))
    return skill.least_steps


def _nothing() -> None:
    """Nothing has failed."""
