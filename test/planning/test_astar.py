# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A*: as short as breadth-first search, always the same, and honest about limits."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from random import Random
from typing import Any

import pytest

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.planning.hmax import HMaxHeuristic
from slap_ros.relational import GroundOperator, LiftedOperator

NOTHING: frozenset[Any] = frozenset()
LIFTED = LiftedOperator("Change", (), NOTHING, NOTHING, NOTHING)


def operator(preconditions: int, add_effects: int, delete_effects: int) -> GroundOperator:
    return GroundOperator(LIFTED, (), preconditions, add_effects, delete_effects & ~add_effects)


def random_problem(seed: int) -> tuple[int, int, list[GroundOperator]]:
    rng = Random(seed)
    atoms = rng.randint(3, 9)

    def few(most: int) -> int:
        return sum({1 << rng.randrange(atoms) for _ in range(rng.randint(0, most))})

    operators = [operator(few(3), few(2), few(3)) for _ in range(rng.randint(2, 14))]
    return few(4), few(4), operators


def breadth_first(start: int, goal: int, operators: Sequence[GroundOperator]) -> int | None:
    """The length of a shortest sequence; None where there is none."""
    lengths, queue = {start: 0}, deque([start])
    while queue:
        state = queue.popleft()
        if state & goal == goal:
            return lengths[state]
        for candidate in operators:
            if candidate.applicable(state):
                successor = candidate.apply(state)
                if successor not in lengths:
                    lengths[successor] = lengths[state] + 1
                    queue.append(successor)
    return None


def test_plans_are_as_short_as_breadth_first_search_finds() -> None:
    lengths = []
    for seed in range(500):
        start, goal, operators = random_problem(seed)
        expected = breadth_first(start, goal, operators)
        if expected is None:
            with pytest.raises(UnsolvableError):
                find_shortest_sequence(start, goal, operators)
            continue
        sequence = find_shortest_sequence(start, goal, operators)
        assert len(sequence) == expected
        assert sequence == find_shortest_sequence(start, goal, operators)
        bound = HMaxHeuristic(goal, operators)(start)
        assert bound is not None and bound <= expected
        state = start
        for index in sequence:
            assert operators[index].applicable(state)
            state = operators[index].apply(state)
        assert state & goal == goal
        lengths.append(expected)
    assert len(lengths) > 200 and max(lengths) >= 4  # these are problems


def test_of_equal_plans_the_one_of_earlier_operators_is_found() -> None:
    twins = [operator(0b01, 0b10, 0), operator(0b01, 0b10, 0)]
    assert find_shortest_sequence(0b01, 0b10, twins) == [0]


def test_nothing_to_do() -> None:
    assert find_shortest_sequence(0b11, 0b01, [], max_states=0) == []


def test_the_limit_is_said() -> None:
    chain = [operator(1 << i, 2 << i, 1 << i) for i in range(6)]
    assert find_shortest_sequence(1, 1 << 6, chain) == list(range(6))
    with pytest.raises(PlanningLimitError, match="within 3 abstract states"):
        find_shortest_sequence(1, 1 << 6, chain, max_states=3)


def test_out_of_reach_by_deletes_and_without() -> None:
    with pytest.raises(UnsolvableError, match="even if operators deleted nothing"):
        find_shortest_sequence(0b001, 0b100, [operator(0b001, 0b010, 0)])
    exclusive = [operator(0b001, 0b010, 0b001), operator(0b001, 0b100, 0b001)]
    with pytest.raises(UnsolvableError, match="1 abstract states were expanded"):
        find_shortest_sequence(0b001, 0b110, exclusive)
