# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Symbolic planning alone: greedy best-first search with the FF heuristic.

Where a task is too large for its abstract graph to be built layer by layer, this finds some
sequence of operators fast; it need not be the shortest. The heuristic is that of Hoffmann and
Nebel, "The FF Planning System" (JAIR 14, 2001): the length of a plan for the relaxed task, in
which operators delete nothing. What such a plan needs after its first layer tells which operators
are helpful now.

Evaluation is deferred: a state is evaluated when it is expanded, and waits in the queue with the
estimate of the state before it, after all states that helpful operators led to.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.arrivals import trace
from slap_ros.relational import GroundOperator

MAX_EXPANSIONS = 100_000  # abstract states; some ten seconds with two hundred operators
MAX_TESTS = 80_000_000  # whether an operator is applicable; some ten seconds


def find_operator_sequence(
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    forbidden: Collection[tuple[int, int]] = (),
    max_expansions: int = MAX_EXPANSIONS,
    max_tests: int = MAX_TESTS,
) -> list[int]:
    """A sequence of operators that leads from an abstract state to the goal.

    The same arguments give the same sequence.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold.
        operators: Ground operators over the same atom space.
        forbidden: Pairs of an abstract state and the index of an operator that must not be
            applied there, because it is known that it cannot be carried out.
        max_expansions: Abstract states to expand before giving up.
        max_tests: How often to look whether an operator is applicable before giving up.

    Returns:
        Indices into ``operators``; none where the goal holds already.

    Raises:
        UnsolvableError: No sequence leads to the goal.
        PlanningLimitError: None was found within ``max_expansions`` and ``max_tests``.
    """
    heuristic = FFHeuristic(goal, operators)
    if heuristic.relaxed_plan(start) is None:
        raise UnsolvableError("the goal is out of reach, even if operators deleted nothing")
    limits = max_expansions, max_tests
    return _best_first(start, goal, operators, heuristic, frozenset(forbidden), limits)


def _best_first(
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    heuristic: FFHeuristic,
    forbidden: frozenset[tuple[int, int]],
    limits: tuple[int, int],
) -> list[int]:
    """Greedy best-first search with deferred evaluation; see :func:`find_operator_sequence`."""
    arrivals = {start: (start, -1)}  # previous state, operator
    queue = [(False, 0, 0, start)]  # unhelpful, estimate, order of discovery, state
    max_expansions, max_tests = limits
    expansions = 0
    while queue:
        *_, state = heapq.heappop(queue)
        if state & goal == goal:
            return trace(arrivals, start, state)
        if expansions >= max_expansions:
            raise PlanningLimitError(
                f"no plan within {max_expansions} expansions of abstract states; raise the limit "
                "or give a goal nearer by"
            )
        if heuristic.tests + expansions * len(operators) > max_tests:
            raise PlanningLimitError(
                f"no plan after {max_tests} tests of operators, in {expansions} expansions of "
                "abstract states; raise the limit or give a goal nearer by"
            )
        expansions += 1
        plan = heuristic.relaxed_plan(state)
        if plan is None:
            continue
        for index, operator, successor in _successors(state, operators, forbidden):
            if successor not in arrivals:
                arrivals[successor] = state, index
                unhelpful = not operator.add_effects & plan.subgoals
                heapq.heappush(queue, (unhelpful, plan.length, len(arrivals), successor))
    raise UnsolvableError(
        f"none of the {len(arrivals)} abstract states that can be reached leads to the goal"
    )


def _successors(
    state: int, operators: Sequence[GroundOperator], forbidden: Collection[tuple[int, int]]
) -> Iterator[tuple[int, GroundOperator, int]]:
    """The applicable operators, with their indices and the abstract states that they lead to."""
    for index, operator in enumerate(operators):
        if operator.applicable(state) and (state, index) not in forbidden:
            yield index, operator, operator.apply(state)


@dataclass(frozen=True, slots=True)
class _RelaxedPlan:
    """A plan for the task in which operators delete nothing."""

    length: int  # operators
    subgoals: int  # mask: what it needs that one operator can add at once


class FFHeuristic:
    """The FF heuristic, on bit masks."""

    def __init__(self, goal: int, operators: Sequence[GroundOperator]) -> None:
        self._goal = goal
        self._operators = [(op.preconditions, op.add_effects) for op in operators]
        self.tests = 0  # of operators so far

    def helpful_atoms(self, state: int) -> int:
        """What an operator adds that is helpful in a state, a mask; none where the goal is lost."""
        plan = self.relaxed_plan(state)
        return 0 if plan is None else plan.subgoals

    def relaxed_plan(self, state: int) -> _RelaxedPlan | None:
        """A plan for the relaxed task; None where there is none, hence none for the task either.

        Each atom is supported by the first operator, in order, of the first layer that adds it.
        """
        supports: list[tuple[int, int]] = []  # atoms first added by an operator, what it needs
        missing, waiting, first_layer = ~state, self._operators, 0
        while self._goal & missing:
            layer = 0
            self.tests += len(waiting)
            for preconditions, add_effects in waiting:
                if not preconditions & missing and (fresh := add_effects & missing & ~layer):
                    layer |= fresh
                    supports.append((fresh, preconditions))
            if not layer:
                return None
            first_layer = first_layer or layer
            missing &= ~layer
            waiting = [operator for operator in waiting if operator[1] & missing]
        return self._extract(supports, first_layer)

    def _extract(self, supports: list[tuple[int, int]], first_layer: int) -> _RelaxedPlan:
        # What an operator needs was added before it, so that one pass backwards finds everything.
        needed, length = self._goal, 0
        for added, preconditions in reversed(supports):
            if needed & added:
                needed |= preconditions
                length += 1
        return _RelaxedPlan(length, needed & first_layer)
