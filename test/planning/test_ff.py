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
from slap_ros.errors import ErrorCode, PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.ff import find_operator_sequence
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import GroundOperator, LiftedOperator, ground_operators
from slap_ros.relational.pddl import parse_domain, parse_problem
from slap_ros.relational.pddl.grounder import ground_task
from support.slap_command import slap

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
    return space.mask(problem.init), space.mask(problem.goal), list(operators)


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


# -- limits ---------------------------------------------------------------------------------------


def hanoi(discs):
    """The towers of Hanoi: a plan of 2^discs - 1 moves, PDDL."""
    domain = """(define (domain hanoi)
      (:predicates (clear ?x) (on ?x ?y) (smaller ?x ?y))
      (:action move :parameters (?disc ?from ?to)
       :precondition (and (smaller ?to ?disc) (on ?disc ?from) (clear ?disc) (clear ?to))
       :effect (and (clear ?from) (on ?disc ?to) (not (on ?disc ?from)) (not (clear ?to)))))"""
    names, pegs = [f"d{i}" for i in range(discs)], ["p1", "p2", "p3"]
    atoms = [f"(smaller {peg} {disc})" for peg in pegs for disc in names]
    atoms += [f"(smaller {b} {a})" for i, a in enumerate(names) for b in names[i + 1 :]]
    tower = [f"(on {a} {b})" for a, b in pairwise(names)]
    start = [*tower, f"(on {names[-1]} p1)", f"(clear {names[0]})", "(clear p2)", "(clear p3)"]
    goal = [*tower, f"(on {names[-1]} p3)"]
    problem = f"""(define (problem hanoi{discs}) (:domain hanoi)
      (:objects {" ".join(names + pegs)}) (:init {" ".join(atoms + start)})
      (:goal (and {" ".join(goal)})))"""
    return domain, problem


def wide(parameters, predicate=1):
    """An operator of so many parameters, and a predicate of so many arguments."""
    variables = [f"?x{i}" for i in range(parameters)]
    arguments = " ".join(f"?x{i}" for i in range(predicate))
    domain = f"""(define (domain wide) (:predicates (a {arguments}) (b))
      (:action go :parameters ({" ".join(variables)}) :precondition () :effect (b)))"""
    objects = " ".join(f"o{i}" for i in range(20))
    return (
        domain,
        f"""(define (problem wide) (:domain wide) (:objects {objects})
      (:init) (:goal (b)))""",
    )


def filled(arguments):
    """An operator that adds atoms of so many arguments."""
    variables = " ".join(f"?x{i}" for i in range(arguments))
    domain = f"""(define (domain filled) (:predicates (a {variables}) (b))
      (:action go :parameters ({variables}) :precondition () :effect (and (a {variables}) (b))))"""
    objects = " ".join(f"o{i}" for i in range(20))
    return (
        domain,
        f"""(define (problem filled) (:domain filled) (:objects {objects})
      (:init) (:goal (and (a {" ".join(["o1"] * arguments)}) (b))))""",
    )


def test_atoms_that_nothing_reaches_cost_nothing(tmp_path):
    result = plan_files(tmp_path, wide(1, predicate=13))
    assert result.exit_code == 0, result.stderr
    assert result.stderr == "1 operator\n"


def plan_files(tmp_path, texts, *options):
    for name, text in zip(("domain.pddl", "problem.pddl"), texts, strict=True):
        (tmp_path / name).write_text(text)
    files = [str(tmp_path / "domain.pddl"), str(tmp_path / "problem.pddl")]
    return slap("plan", *files, *options)


@pytest.mark.parametrize(
    ("texts", "advice"),
    [
        (hanoi(14), "--effort 10"),
        (wide(13), "--effort 10"),
        (filled(4), "fewer objects"),  # memory: no effort is of use
    ],
    ids=["hanoi", "operator", "atoms"],
)
def test_planning_without_end_is_given_up_and_says_what_helps(tmp_path, monkeypatch, texts, advice):
    monkeypatch.setattr("slap_ros.planning.greedy.MAX_TESTS", 400_000)  # else minutes
    monkeypatch.setattr("slap_ros.cli.plan_pddl.MAX_BINDINGS", 20_000)
    monkeypatch.setattr("slap_ros.relational.pddl.grounder.MAX_ATOMS", 5_000)
    result = plan_files(tmp_path, texts)
    assert result.exit_code == ErrorCode.PLANNING_LIMIT, result.stderr
    assert advice in result.stderr


@pytest.mark.parametrize(
    ("planner", "limit"),
    [
        ("anytime", "slap_ros.planning.greedy.MAX_TESTS"),
        ("astar", "slap_ros.planning.least_cost.MAX_TESTS"),
    ],
)
def test_more_effort_goes_further(tmp_path, monkeypatch, planner, limit):
    monkeypatch.setattr(limit, 1_000)
    chosen = ("--planner", planner)
    assert plan_files(tmp_path, hanoi(4), *chosen).exit_code == ErrorCode.PLANNING_LIMIT
    result = plan_files(tmp_path, hanoi(4), *chosen, "--effort", "100")
    assert result.exit_code == 0, result.stderr
    assert "operators" in result.stderr


def test_the_limits_are_those_that_are_stated():
    """Some seconds each; grounding and atoms are bounded wherever they are made."""
    domain, problem = hanoi(14)
    stated = parse_domain(domain)
    task = parse_problem(problem, stated)
    space = task.atom_space(stated)
    with pytest.raises(PlanningLimitError, match="more than 1000 bindings"):
        ground_operators(stated.operators, space, max_bindings=1_000)
    whole = ground_operators(stated.operators, space)
    assert whole == ground_operators(stated.operators, space, max_bindings=10_000)
    small = parse_problem(hanoi(6)[1], stated)
    with pytest.raises(PlanningLimitError, match="more than 100 bindings"):
        ground_task(stated, small, max_bindings=100)
    assert ground_task(stated, small) == ground_task(stated, small, max_bindings=10_000)
