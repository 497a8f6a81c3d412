# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Anytime planning against lazy search on made-up problems, in which options fail as well."""

import random
from dataclasses import dataclass, replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, PlanningLimitError, UnsolvableError
from slap_ros.planning import plan_improvement
from slap_ros.planning.abstract_graph import Edge
from slap_ros.planning.anytime import AnytimePlanner, PlanningInterrupted
from slap_ros.planning.effort import Effort
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.landmark_cut import RelaxedOperator
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.problem import Problem
from slap_ros.relational import Feature, GroundOperator, Layout, State, Type
from slap_ros.signals import TerminatedError, exit_code

WORLD = Layout.of((Type("world", (Feature("mask", "1"), Feature("detail", "1")))("w"),))
ATOMS = 7
EFFORTS = (Effort(), Effort(rollouts=8), Effort(tests=20))
LIFTED = get_domain("obstacle2d").operators[0]  # names the made-up ones


@dataclass(frozen=True)
class Skill:
    """Takes steps that depend on the low-level state, and fails in some of them."""

    name: str
    seed: int
    least_steps: int
    failing: float
    spread: int = 20
    step_limit: int = 1000

    def lower_bound(self, state, objects):
        return self.least_steps

    def start(self, state, objects):
        raise AssertionError("never run: the model below knows the outcome")


class Space:
    """The abstract state is written in the low-level one."""

    def abstract(self, state):
        return int(state.data[0])

    def decode(self, mask):
        return ()

    def mask(self, atoms):
        return 0


class MadeUpModel(Model):
    """A model without a world."""

    def __init__(self):
        super().__init__(None, Space(), None)

    def _simulate(self, option, state, target):
        skill = option.skill
        rng = np.random.default_rng([skill.seed, int(state.data[1]), target.required])
        detail, more = float(rng.integers(0, 4)), int(rng.integers(skill.spread))
        if rng.random() < skill.failing:
            result = OptionResult(ErrorCode.SKILL_STOPPED_SHORT, f"{option} fails")
            return Rollout(False, 0, state, self.space.abstract(state), result)
        final = State(WORLD, [float(target.required), detail])
        steps = skill.least_steps + more + option.attempt
        return Rollout(True, steps, final, target.required)


@dataclass(frozen=True)
class MadeUpShortcuts:
    """One shortcut, which adds some atoms at once, in two ways."""

    skill: Skill
    added: int

    def edges(self, graph):
        joined = {(edge.source, edge.target) for edge in graph.edges}
        return [
            Edge(i, j, self._option(0))
            for i, source in enumerate(graph.nodes)
            for j, target in enumerate(graph.nodes)
            if i < j and (i, j) not in joined and 0 < target & ~source <= self.added
            if target & ~source & ~self.added == 0
        ]

    def beyond(self, graph, within):
        return []

    def relaxed(self):
        return [RelaxedOperator(0, self.added, self.skill.least_steps)]

    def may_begin(self, abstract):
        return bool(self.added & ~abstract)

    def forget_failures_since_now(self):
        return lambda: None

    def _option(self, attempt):
        def following():
            return self._option(attempt + 1) if attempt == 0 else None

        return Option(OptionKind.SHORTCUT, self.skill, (), attempt=attempt, next_attempt=following)


def made_up(seed):
    """A problem, its shortcuts, where it starts, and its goal."""
    rng = random.Random(seed)
    failing = rng.choice([0.0, 0.3, 0.6])

    def mask(most):
        return sum(1 << bit for bit in rng.sample(range(ATOMS), rng.randint(0, most)))

    operators = []
    for number in range(rng.randint(4, 14)):
        added = mask(2) or 1 << number % ATOMS
        ground = GroundOperator(LIFTED, (), mask(2), added, mask(2) & ~added)
        skill = Skill(f"o{number}", rng.randrange(10**6), rng.randint(1, 5), failing)
        operators.append((ground, Option(OptionKind.OPERATOR, skill, ())))
    shortcuts = MadeUpShortcuts(Skill("x", rng.randrange(10**6), 2, 0.3), mask(5) or 1)
    start = State(WORLD, [float(mask(2)), 0.0])
    problem = Problem(MadeUpModel(), tuple(operators))
    return problem, rng.choice([None, shortcuts]), start, mask(3) or 1


def plan(planner, start, goal):
    try:
        return planner.plan(start, goal)
    except (UnsolvableError, PlanningLimitError):
        return None


@pytest.mark.parametrize("effort", [Effort(), Effort(rollouts=8), Effort(tests=20)], ids=str)
@pytest.mark.parametrize("small", [0, plan_improvement.SMALL])
def test_lazy_search_finds_nothing_below_what_is_proven(effort, small, monkeypatch):
    monkeypatch.setattr(plan_improvement, "SMALL", small)
    solved = 0
    for seed in range(120):
        problem, shortcuts, start, goal = made_up(seed)
        lazy = plan(GraphPlanner(problem, shortcuts=shortcuts), start, goal)
        problem = made_up(seed)[0]
        found = plan(AnytimePlanner(problem, shortcuts, effort), start, goal)
        if lazy is None or found is None:
            assert lazy is None or effort != Effort()  # little effort may find nothing
            continue
        solved += 1
        assert found.at_least <= lazy.steps
        assert found.steps <= lazy.steps * found.bound
    assert solved > 50


def two_ways(model):
    """An operator that fails, and two that lead to the goal together, the first slow or fast."""
    goal, between = 1, 2
    operators = [
        (GroundOperator(LIFTED, (), needed, added, 0), Option(OptionKind.OPERATOR, skill, ()))
        for skill, needed, added in (
            (Skill("fails", 0, 1, failing=1.0, spread=1), 0, goal),
            (Skill("slow", 0, 20, failing=0.0, spread=1), 0, between),
            (Skill("fast", 0, 1, failing=0.0, spread=1), 0, between),
            (Skill("last", 0, 2, failing=0.0, spread=1), between, goal),
        )
    ]
    return Problem(model, tuple(operators)), State(WORLD, [0.0, 0.0]), goal


def test_a_graph_without_a_plan_proves_nothing_of_a_deeper_one(monkeypatch):
    monkeypatch.setattr(plan_improvement, "SMALL", 0)
    problem, start, goal = two_ways(MadeUpModel())
    found = AnytimePlanner(problem).plan(start, goal)
    lazy = GraphPlanner(problem).plan(start, goal)
    assert lazy.steps == 3
    assert found.steps == 22  # slow comes first
    assert found.at_least <= 3


def test_planning_near_a_plan_of_one_edge_ends():
    domain = get_domain("obstacle2d")
    task = domain.task(1)
    problem = Problem.of(domain, task.initial_state)
    start = problem.model.space.abstract(task.initial_state)
    first = next(ground for ground, _ in problem.operators if ground.applicable(start))
    planner = AnytimePlanner(problem, effort=Effort(tests=1))
    assert len(planner.plan(task.initial_state, first.apply(start)).plan.edges) == 1
    assert planner.plan(task.initial_state, start).bound == 1.0


def test_a_plan_does_not_depend_on_what_was_planned_before():
    domain = get_domain("obstacle2d")
    task = domain.task(1)
    problem = Problem.of(domain, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    planner = AnytimePlanner(problem, effort=Effort(rollouts=2))
    once, again = (planner.plan(task.initial_state, goal) for _ in range(2))
    assert (once.plan, once.at_least) == (again.plan, again.at_least)
    assert once.edges_rolled_out > 0
    assert again.edges_rolled_out == 0  # they are known


class TerminatedModel(MadeUpModel):
    """SIGTERM arrives when the alternative is tried."""

    def _simulate(self, option, state, target):
        if option.skill.name == "fast":
            raise TerminatedError
        return super()._simulate(option, state, target)


def test_planning_that_is_terminated_says_so_in_its_exit_code():
    problem, start, goal = two_ways(TerminatedModel())
    problem = replace(problem, operators=problem.operators[1:])  # without the one that fails
    with pytest.raises(PlanningInterrupted) as caught:
        AnytimePlanner(problem, effort=Effort(tests=1)).plan(start, goal)
    assert caught.value.best.steps == 22
    assert exit_code(caught.value) == 143
