# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How deep nodes are in an abstract graph that is never made: bounds from both sides."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.ff import find_operator_sequence
from slap_ros.planning.landmark_cut import RelaxedOperator
from slap_ros.planning.potential import LeastSteps, alternate
from slap_ros.relational import GroundOperator

MAX_EXPANSIONS = 2_000  # abstract states, to find a way by operators
MAX_BOUNDS = 40  # of abstract states, to prove how long such a way is at least


@dataclass(frozen=True)
class Depth:
    """The number of operators on a shortest way from the start to an abstract state.

    Args:
        at_least: A lower bound.
        at_most: The length of some way.
    """

    at_least: int
    at_most: int


class GraphDepth:
    """Depths in the graph of one start and one goal."""

    def __init__(
        self,
        start: int,
        goal: int,
        operators: Sequence[GroundOperator],
        fewest: Callable[[int], int | None],
        first: int,
    ) -> None:
        """Work out how deep the first goal state is, if that is known.

        Args:
            start: Abstract state of the first node, a mask.
            goal: Mask of atoms that must hold.
            operators: Ground operators.
            fewest: Function from an abstract state to the number of operators to the goal, at
                least; None where it is out of reach.
            first: Number of operators of a plan that can be executed; 0 if none is known.
        """
        self._start, self._goal, self._operators = start, goal, operators
        self.fewest = fewest
        self.goal_at_least = fewest(start) or 0
        is_known = first == self.goal_at_least and alternate(operators, start)
        # Where each forward edge of an operator leads to the next layer, and plans end in the last.
        self.layers = first if is_known else None
        self._relaxed = [
            RelaxedOperator(one.preconditions, one.add_effects, 1, one.delete_effects)
            for one in operators
        ]
        self.of = cache(self._find)

    def is_before_goal(self, abstract: int, depth: int) -> bool:
        """Whether a shortest way to a goal state is through an abstract state.

        Args:
            abstract: Abstract state, a mask.
            depth: Number of operators to it on some way.
        """
        rest = self._way(abstract, self._goal)
        return rest is not None and depth + len(rest) == self.layers

    def successors(self, abstract: int) -> set[int]:
        """The abstract states after one operator."""
        return {one.apply(abstract) for one in self._operators if one.applicable(abstract)}

    def _find(self, abstract: int) -> Depth | None:
        """The depth of an abstract state; None where no way to it is found."""
        way = self._way(self._start, abstract)
        if way is None:
            return None
        reached = self._start
        for index in way:
            reached = self._operators[index].apply(reached)
        return Depth(self._at_least(abstract, len(way)), len(way)) if reached == abstract else None

    def _way(self, start: int, goal: int) -> Sequence[int] | None:
        """Operators that lead to some atoms, all masks; None if none are found soon."""
        try:
            return find_operator_sequence(
                start, goal, self._operators, max_expansions=MAX_EXPANSIONS
            )
        except (UnsolvableError, PlanningLimitError):
            return None

    def _at_least(self, target: int, enough: int) -> int:
        """The length of a way to an abstract state at least, by A* that may be given up."""
        bound, queued = LeastSteps(target, self._relaxed), {self._start: 0}
        queue = [(bound(self._start) or 0, 0, self._start)]
        while queue:
            f, minus_g, state = heapq.heappop(queue)
            if f >= enough or len(queued) >= MAX_BOUNDS or state == target:
                return f
            g = 1 - minus_g
            for following in sorted(self.successors(state)):
                if queued.get(following, g + 1) > g:
                    queued[following] = g
                    to_come = bound(following)
                    if to_come is not None:
                        heapq.heappush(queue, (max(f, g + to_come), -g, following))
        return enough
