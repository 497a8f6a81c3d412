# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators from demonstrations: those that made the demonstrations, whatever flickers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random

import pytest

from slap_ros.acquisition.proposals.induction import (
    InducedProposer,
    hold_steps_of,
    induce_operators,
    stable_states,
)
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.core import Task
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, ProposalRejectedError
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.relational import (
    Column,
    GroundAtom,
    GroundOperator,
    LiftedOperator,
    Predicate,
    State,
    Type,
)
from slap_ros.relational.predicates import Bools
from support.paper_problems import ALL, Printed, peg_in_hole, stow_hammer

PEGS = peg_in_hole()
Trace = list[frozenset[GroundAtom]]


def demonstration(printed: Printed, goal: str, rng: Random) -> Trace:
    """A plan step by step; between two abstract states, passages of one or two steps."""
    problem = printed.with_goal(goal)
    plan = verify(printed.operators, problem).plan
    assert plan is not None
    return acted(problem, plan, rng)


def acted(problem: AcquisitionProblem, plan: Sequence[GroundOperator], rng: Random) -> Trace:
    state = problem.start_mask
    trace = [atoms(problem, state)] * rng.randint(3, 9)
    for step in plan:
        following = step.apply(state)
        passage = [bit for bit in bits(state ^ following) if rng.random() < 0.5]
        trace += [atoms(problem, state ^ sum(passage))] * rng.randint(0, 2)
        state = following
        trace += [atoms(problem, state)] * rng.randint(3, 9)
    return trace


def atoms(problem: AcquisitionProblem, mask: int) -> frozenset[GroundAtom]:
    return frozenset(problem.space.decode(mask))


def bits(mask: int) -> list[int]:
    return [1 << i for i in range(mask.bit_length()) if mask >> i & 1]


def shown(printed: Printed, demonstrations: int, seed: int = 0) -> AcquisitionProblem:
    rng = Random(seed)
    goals = list(printed.goals)
    traces = [demonstration(printed, rng.choice(goals), rng) for _ in range(demonstrations)]
    return replace(printed.problem, shown=tuple(map(tuple, traces)))


def meaning(operators: Sequence[LiftedOperator]) -> set[tuple[frozenset[str], ...]]:
    """Effects, with types for variables: enough to tell the paper's operators apart."""
    return {
        tuple(
            frozenset(f"{a.predicate}{[v.type.name for v in a.variables]}" for a in part)
            for part in (op.add_effects, op.delete_effects)
        )
        for op in operators
    }


@pytest.mark.parametrize("make", ALL, ids=[make.__name__ for make in ALL])
def test_ten_demonstrations_plan_every_goal_in_the_papers_length(
    make: Callable[[], Printed],
) -> None:
    printed = make()
    problem = shown(printed, 10)
    operators = InducedProposer("demonstrations").operators(problem).operators
    assert meaning(operators) == meaning(printed.operators)
    for goal, (_, length) in printed.goals.items():
        plan = verify(operators, printed.with_goal(goal)).plan
        assert plan is not None and len(plan) == length


@pytest.mark.parametrize("make", ALL, ids=[make.__name__ for make in ALL])
def test_one_demonstration_plans_what_it_shows(make: Callable[[], Printed]) -> None:
    printed = make()
    trace = tuple(demonstration(printed, "training", Random(1)))
    proposal = InducedProposer("one").operators(replace(printed.problem, shown=(trace,)))
    assert proposal.plan is not None and len(proposal.plan) == printed.plan_length
    assert proposal.provenance.proposer == "induced"


def test_preconditions_seen_once_are_marked_and_further_ones_drop() -> None:
    stow = stow_hammer()
    once = demonstration(stow, "test2", Random(2))
    (open_, *_) = induce_operators([once])
    assert open_.operator.name == "AchieveIsCabinetOpen"
    twice = induce_operators([once, *shown(stow, 9).shown])
    assert twice[0].seen > 1
    for few, many in zip(induce_operators([once]), twice, strict=False):
        assert many.operator.preconditions <= few.operator.preconditions
    remarks = InducedProposer("x").operators(replace(PEGS.problem, shown=short_show())).remarks
    assert any("seen once; each of its preconditions may be too many" in r for r in remarks)


def short_show() -> tuple[tuple[frozenset[GroundAtom], ...], ...]:
    """Two pegs picked, but only the first one inserted and seen so for good."""
    problem = PEGS.problem
    plan = verify(PEGS.operators, problem).plan
    assert plan is not None
    return (tuple(acted(problem, plan[:3], Random(0))),)


def test_what_is_only_lost_for_a_while_is_a_passage_however_long() -> None:
    """A drawer on its way is neither closed nor open, for many steps."""
    stow = stow_hammer()
    plan = verify(stow.operators, stow.problem).plan
    assert plan is not None
    state = stow.problem.start_mask
    trace = [atoms(stow.problem, state)] * 9
    for step in plan:
        trace += [atoms(stow.problem, state & ~step.delete_effects)] * 9
        state = step.apply(state)
        trace += [atoms(stow.problem, state)] * 9
    assert meaning([one.operator for one in induce_operators([trace])]) == meaning(stow.operators)
    (begun,) = induce_operators([[stow.problem.init] * 9 + [trace[9]] * 9])  # it ends on its way
    assert begun.operator.name.startswith("End")


@pytest.mark.parametrize(("period_s", "steps"), [(0.05, 6), (0.1, 3), (0.125, 3), (1.0, 3)])
def test_atoms_have_to_last_in_time_and_in_steps(period_s: float, steps: int) -> None:
    assert hold_steps_of(period_s) == steps


def test_operators_have_different_names_also_where_predicates_end_in_numbers() -> None:
    def never(state: State, *columns: Column) -> Bools:
        raise AssertionError("no state is looked at")

    thing = Type("thing")
    on, on2 = (Predicate(name, (thing,), never)(thing("a")) for name in ("On", "On2"))
    trace = [held for held in (set(), {on2}, {on}, {on2}, {on, on2}) for _ in range(4)]
    induced = induce_operators([[frozenset(held) for held in trace]])
    assert [one.operator.name for one in induced] == [
        "AchieveOn2",  # where nothing held
        "AchieveOn",
        "AchieveOn22",  # in the place of On
        "AchieveOn3",  # beside On2
    ]


def test_flicker_is_no_change() -> None:
    on, off = PEGS.problem.init, frozenset[GroundAtom]()
    trace = [*[on] * 5, *[off] * 2, *[on] * 5, off, on, on]
    assert stable_states(trace) == [on]
    assert stable_states(trace, 2) == [on, off, on]
    assert stable_states([]) == []
    with pytest.raises(InvalidParameterError):
        stable_states(trace, 0)


def test_demonstrations_in_which_nothing_happens_are_refused() -> None:
    still = replace(PEGS.problem, shown=((PEGS.problem.init,) * 20,))
    for problem in (PEGS.problem, still):
        with pytest.raises(ProposalRejectedError, match="nothing changes"):
            InducedProposer("none").operators(problem)


def executed(task: Task) -> Trace:
    """The atoms along a plan that is carried out in the domain's world."""
    domain = get_domain("obstacle2d")
    space = domain.atom_space(task.initial_state)
    world = domain.make_world(task.initial_state)
    states = [task.initial_state]
    step = world.step
    world.step = lambda action: states.append(step(action)) or states[-1]  # type: ignore
    Executor(
        domain, make_planner("lazy", domain, task.initial_state), world, space,
        space.mask(task.goal), task.step_limit,
    ).run()  # fmt: skip
    return [frozenset(space.decode(space.abstract(state))) for state in states]


def test_a_world_with_real_states_gives_operators_that_plan() -> None:
    """Obstacle 2D: what its skills did is induced from states alone, and plans unseen tasks."""
    domain = get_domain("obstacle2d")
    traces = tuple(tuple(executed(domain.task(seed))) for seed in range(8))
    for seed in range(20, 25):
        problem = replace(AcquisitionProblem.of_task(domain, domain.task(seed)), shown=traces)
        induced = InducedProposer("executed").operators(problem)
        by_hand = verify(domain.operators, problem)
        assert by_hand.plan is not None and induced.plan is not None
        assert len(induced.plan) <= len(by_hand.plan) + 1
