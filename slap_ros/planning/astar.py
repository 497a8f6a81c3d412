# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortest sequences of operators: A* over abstract states with the heuristic h_max.

A* is that of Hart, Nilsson and Raphael (1968); the heuristic, :class:`~.hmax.HMaxHeuristic`, is
consistent, so that an abstract state's first expansion is on a shortest way to it, and the sequence
has as few operators as any. Where :mod:`~.ff` finds some sequence fast, this finds a shortest one,
and a proof that there is none. Of several shortest sequences it always finds the same: of abstract
states with equal estimates, the one nearer the goal by the heuristic is expanded first, then the
one discovered first, and operators are tried in the order in which they are given.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.arrivals import trace
from slap_ros.planning.hmax import HMaxHeuristic
from slap_ros.relational import GroundOperator

MAX_STATES = 100_000  # abstract states; some ten seconds with fifty operators


def find_shortest_sequence(
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    max_states: int = MAX_STATES,
) -> list[int]:
    """A shortest sequence of operators from an abstract state to the goal.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold.
        operators: Ground operators over the same atom space.
        max_states: Abstract states to discover before giving up: the heuristic looks at every
            operator for each of them, and that is what takes the time.

    Returns:
        Indices into ``operators``; none where the goal holds already.

    Raises:
        UnsolvableError: No sequence leads to the goal.
        PlanningLimitError: None was found within ``max_states``.
    """
    distance = HMaxHeuristic(goal, operators)
    at_least = distance(start)
    if at_least is None:
        raise UnsolvableError("the goal is out of reach, even if operators deleted nothing")
    lengths = {start: 0}
    arrivals: dict[int, tuple[int, int]] = {}  # previous state, operator
    queue = [(at_least, at_least, 0, start)]  # estimate, heuristic, order of discovery, state
    expanded: set[int] = set()
    discovered = 0
    while queue:
        *_, state = heapq.heappop(queue)
        if state & goal == goal:
            return trace(arrivals, start, state)
        if state in expanded:
            continue
        expanded.add(state)
        length = lengths[state] + 1
        for index, operator in enumerate(operators):
            if not operator.applicable(state):
                continue
            successor = operator.apply(state)
            if length >= lengths.get(successor, length + 1):
                continue
            remaining = distance(successor)
            if remaining is None:
                continue
            lengths[successor], arrivals[successor] = length, (state, index)
            discovered += 1
            if discovered > max_states:
                raise PlanningLimitError(
                    f"no plan within {max_states} abstract states; raise the limit or give a goal "
                    "nearer by"
                )
            heapq.heappush(queue, (length + remaining, remaining, discovered, successor))
    raise UnsolvableError(
        f"no sequence of operators leads to the goal: {len(expanded)} abstract states were expanded"
    )
