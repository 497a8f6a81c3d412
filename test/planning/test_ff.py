# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The FF planner: plans are valid, verdicts agree with exhaustive search, limits hold."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
from itertools import pairwise
from random import Random
from typing import Any, cast

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slap_ros.domains.registry import get_domain
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.ff import find_operator_sequence
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import GroundOperator, LiftedOperator, ground_operators
from slap_ros.relational.pddl import parse_domain, parse_problem

Task = tuple[int, int, list[GroundOperator]]  # start, goal, operators
NOTHING: frozenset[Any] = frozenset()

BLOCKS_WORLD = parse_domain("""
(define (domain blocks-world)
  (:types block)
  (:predicates (on ?a ?b - block) (on-table ?a - block) (clear ?a - block)
    (holding ?a - block) (hand-empty))
  (:action pick-up :parameters (?a - block)
    :precondition (and (clear ?a) (on-table ?a) (hand-empty))
    :effect (and (holding ?a) (not (clear ?a)) (not (on-table ?a)) (not (hand-empty))))
  (:action put-down :parameters (?a - block)
    :precondition (holding ?a)
    :effect (and (clear ?a) (on-table ?a) (hand-empty) (not (holding ?a))))
  (:action stack :parameters (?a ?b - block)
    :precondition (and (holding ?a) (clear ?b))
    :effect (and (on ?a ?b) (clear ?a) (hand-empty) (not (holding ?a)) (not (clear ?b))))
  (:action unstack :parameters (?a ?b - block)
    :precondition (and (on ?a ?b) (clear ?a) (hand-empty))
    :effect (and (holding ?a) (clear ?b) (not (on ?a ?b)) (not (clear ?a)) (not (hand-empty)))))
""")


def blocks_world(blocks: int, seed: int) -> Task:
    """Random towers to be rebuilt as other random towers."""
    rng = Random(seed)
    names = [f"b{i}" for i in range(blocks)]

    def towers() -> list[list[str]]:
        remaining, found = rng.sample(names, blocks), []
        while remaining:
            height = rng.randint(1, len(remaining))
            found.append(remaining[:height])
            remaining = remaining[height:]
        return found

    def layers(tower: list[str]) -> str:
        stacked = "".join(f"(on {above} {below})" for below, above in pairwise(tower))
        return f"(on-table {tower[0]})" + stacked

    first = "".join(f"{layers(tower)} (clear {tower[-1]})" for tower in towers())
    last = "".join(map(layers, towers()))
    problem = parse_problem(
        f"""(define (problem towers) (:domain blocks-world) (:objects {" ".join(names)} - block)
        (:init (hand-empty) {first}) (:goal (and {last})))""",
        BLOCKS_WORLD,
    )
    space = problem.atom_space(BLOCKS_WORLD)
    operators = ground_operators(BLOCKS_WORLD.operators, space)
    return problem.initial_mask(space), problem.goal_mask(space), list(operators)


def operator(preconditions: int, add_effects: int, delete_effects: int) -> GroundOperator:
    lifted = LiftedOperator("Change", (), NOTHING, NOTHING, NOTHING)
    return GroundOperator(lifted, (), preconditions, add_effects, delete_effects & ~add_effects)


@st.composite
def tasks(draw: st.DrawFn) -> Task:
    """Few atoms and operators, so that all states can be enumerated."""
    atoms = draw(st.integers(1, 7))
    masks = st.integers(0, 2**atoms - 1)
    few = st.lists(st.integers(0, atoms - 1), max_size=2).map(
        lambda bits: sum({1 << b for b in bits})
    )
    operators = draw(st.lists(st.builds(operator, few, few, masks), max_size=12))
    return draw(masks), draw(masks), operators


def follow(start: int, sequence: Sequence[int], operators: Sequence[GroundOperator]) -> list[int]:
    """The states along a sequence of operators, each of which must be applicable."""
    states = [start]
    for index in sequence:
        assert operators[index].applicable(states[-1])
        states.append(operators[index].apply(states[-1]))
    return states


def reachable(
    start: int,
    operators: Sequence[GroundOperator],
    forbidden: Collection[tuple[int, int]] = (),
) -> set[int]:
    """All states, by exhaustive search."""
    found, queue = {start}, deque([start])
    while queue:
        state = queue.popleft()
        for index, candidate in enumerate(operators):
            if candidate.applicable(state) and (state, index) not in forbidden:
                successor = candidate.apply(state)
                if successor not in found:
                    found.add(successor)
                    queue.append(successor)
    return found


@pytest.mark.parametrize("blocks", [4, 8, 10])
@pytest.mark.parametrize("seed", range(4))
def test_rebuilds_towers(blocks: int, seed: int) -> None:
    start, goal, operators = blocks_world(blocks, seed)
    sequence = find_operator_sequence(start, goal, operators)
    states = follow(start, sequence, operators)
    assert states[-1] & goal == goal
    assert len(set(states)) == len(states)  # never in the same place twice
    assert find_operator_sequence(start, goal, operators) == sequence


@pytest.mark.parametrize("seed", range(10))
def test_solves_obstacle2d(seed: int) -> None:
    domain = get_domain("obstacle2d")
    task = domain.task(seed)
    space = domain.atom_space(task.initial_state)
    operators = domain.ground(space)
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    sequence = find_operator_sequence(start, goal, operators)
    assert follow(start, sequence, operators)[-1] & goal == goal


@given(tasks())
@settings(max_examples=250, deadline=None)
def test_agrees_with_exhaustive_search(task: Task) -> None:
    start, goal, operators = task
    if any(state & goal == goal for state in reachable(start, operators)):
        states = follow(start, find_operator_sequence(*task), operators)
        assert states[-1] & goal == goal
    else:
        with pytest.raises(UnsolvableError):
            find_operator_sequence(*task)


@given(tasks(), st.data())
@settings(max_examples=200, deadline=None)
def test_avoids_forbidden_edges(task: Task, data: st.DataObject) -> None:
    start, goal, operators = task
    assume(operators)
    states = st.sampled_from(sorted(reachable(start, operators)))
    forbidden = data.draw(st.sets(st.tuples(states, st.integers(0, len(operators) - 1))))
    if any(state & goal == goal for state in reachable(start, operators, forbidden)):
        sequence = find_operator_sequence(start, goal, operators, forbidden)
        visited = follow(start, sequence, operators)
        assert visited[-1] & goal == goal
        assert forbidden.isdisjoint(zip(visited, sequence, strict=False))
    else:
        with pytest.raises(UnsolvableError):
            find_operator_sequence(start, goal, operators, forbidden)


def test_takes_another_way_while_there_is_one() -> None:
    """Each plan's first edge turns out infeasible in its turn."""
    way_round = [
        operator(0b001, 0b100, 0),
        operator(0b001, 0b010, 0b001),
        operator(0b010, 0b100, 0),
    ]
    assert find_operator_sequence(0b001, 0b100, way_round) == [0]
    assert find_operator_sequence(0b001, 0b100, way_round, [(0b001, 0)]) == [1, 2]
    with pytest.raises(UnsolvableError, match="none of the 1 abstract states"):
        find_operator_sequence(0b001, 0b100, way_round, [(0b001, 0), (0b001, 1)])


def test_empty_where_the_goal_holds() -> None:
    assert find_operator_sequence(0b11, 0b01, [], max_expansions=0) == []


def test_unreachable_even_without_deletes() -> None:
    with pytest.raises(UnsolvableError, match="even if operators deleted nothing"):
        find_operator_sequence(0b001, 0b100, [operator(0b001, 0b010, 0)])


def test_unreachable_because_of_deletes() -> None:
    exclusive = [operator(0b001, 0b010, 0b001), operator(0b001, 0b100, 0b001)]
    with pytest.raises(UnsolvableError, match="none of the 3 abstract states"):
        find_operator_sequence(0b001, 0b110, exclusive)


def test_gives_up_exactly_at_the_limit() -> None:
    start, goal, operators = blocks_world(6, seed=0)
    needed = 0
    while True:
        try:
            sequence = find_operator_sequence(start, goal, operators, max_expansions=needed)
        except PlanningLimitError as error:
            assert f"within {needed} expansions" in str(error)
            needed += 1
            continue
        break
    assert needed >= len(sequence) > 0
    assert sequence == find_operator_sequence(start, goal, operators)


def test_plain_pddl_has_an_abstract_graph() -> None:
    """A breadth-first plan is shortest, so that FF's is no shorter."""
    start, goal, operators = blocks_world(4, seed=2)
    no_skill = cast(Any, None)  # nothing is executed here
    paired = [(op, Option(OptionKind.OPERATOR, no_skill, op.objects)) for op in operators]
    graph = build_abstract_graph(start, goal, paired)
    depth = graph.depth[graph.goal_nodes[0]]
    assert len(find_operator_sequence(start, goal, operators)) >= depth > 0
