# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Search: the lazy one costs what the exhaustive one costs, on tasks and on made-up graphs."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.domains import get_domain
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.lazy_search import SearchLimits, search_lazily
from slap_ros.planning.model import Rollout
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import Feature, Layout, State, Target, Type

COUNTER = Type("counter", (Feature("value", "1"),))
LAYOUT = Layout.of((COUNTER("c"),))


@dataclass(frozen=True)
class MadeUpSkill:
    """Costs that depend on the low-level state, under bounds of any tightness."""

    name: str
    seed: int
    tightness: float
    step_limit: int = 1000
    least_steps: int = 1

    def true_cost(self, state):
        rng = np.random.default_rng([self.seed, int(state.data[0])])
        return 1 + int(rng.integers(0, 20))

    def lower_bound(self, state, objects):
        return max(1, int(self.tightness * self.true_cost(state)))

    def start(self, state, objects):
        raise AssertionError("never run: the model below knows the outcome")


class MadeUpModel:
    """Roll-outs by table: deterministic, path-dependent, some infeasible."""

    space = SimpleNamespace(decode=lambda mask: (), abstract=lambda state: 0)
    outcomes = 6  # few distinct values, so that paths meet again in equal low-level states

    def __init__(self):
        self.executed = 0

    def roll_out(self, option, state, target):
        self.executed += 1
        skill = option.skill
        rng = np.random.default_rng([skill.seed, int(state.data[0]), 1 + option.attempt])
        feasible = rng.random() > 0.15
        final = State(LAYOUT, [float(rng.integers(0, self.outcomes))])
        return Rollout(bool(feasible), skill.true_cost(state) + 2 * option.attempt, final)

    def raised_bound(self, option, state, target, steps):
        return steps


class UnmetModel(MadeUpModel):
    """Paths never meet again, so that it does not matter which of equals comes first."""

    outcomes = 10**9

    def roll_out(self, option, state, target):
        rollout = super().roll_out(option, state, target)
        number = int(option.skill.name[1:])
        return replace(rollout, final=State(LAYOUT, rollout.final.data + number * self.outcomes))


class TellingModel(UnmetModel):
    """The same roll-outs, of which one step more is known each time that somebody asks."""

    def raised_bound(self, option, state, target, steps):
        rollout = super().roll_out(option, state, target)
        most = rollout.steps if rollout.reached else 30
        return min(steps + 1, max(steps, most))


def in_ways(skill, count, attempt=0):
    """An option that can be done in so many ways, each longer than the one before."""
    return Option(
        OptionKind.SHORTCUT,
        skill,
        (),
        attempt=attempt,
        next_attempt=lambda: in_ways(skill, count, attempt + 1) if attempt + 1 < count else None,
    )


@st.composite
def made_up_graphs(draw):
    size = draw(st.integers(2, 9))
    tightness = draw(st.sampled_from([0.0, 0.5, 1.0]))
    graph = AbstractGraph(goal=1 << 20, nodes=[i + 1 for i in range(size)], depth=[0] * size)
    goals = draw(st.sets(st.integers(1, size - 1), min_size=1))
    for goal in goals:
        graph.nodes[goal] |= 1 << 20
    pairs = [(i, j) for i in range(size) for j in range(size) if i != j and i not in goals]
    for number, (i, j) in enumerate(
        draw(st.lists(st.sampled_from(pairs), max_size=25, unique=False))
    ):
        skill = MadeUpSkill(f"s{number}", draw(st.integers(0, 10**6)), tightness)
        graph.edges.append(Edge(i, j, in_ways(skill, draw(st.integers(1, 3)))))
    return graph


def cost_or_none(search, graph):
    model = MadeUpModel()
    plan = search(graph, State(LAYOUT, [0.0]), model).plan
    return None if plan is None else plan.predicted_steps


@settings(max_examples=400, deadline=None)
@given(made_up_graphs())
def test_lazy_and_exhaustive_agree_on_made_up_graphs(graph):
    assert cost_or_none(search_lazily, graph) == cost_or_none(search_exhaustively, graph)


@settings(max_examples=400, deadline=None)
@given(made_up_graphs(), st.sampled_from([1.0, 3.0, 30.0]))
def test_bounds_that_rise_bit_by_bit_lead_to_the_same_plan(graph, weight):
    limits = SearchLimits(weight)
    plans = [
        search_lazily(graph, State(LAYOUT, [0.0]), model, limits).plan
        for model in (UnmetModel(), TellingModel())
    ]
    assert plans[0] == plans[1]


@dataclass(frozen=True)
class WronglyBoundedSkill(MadeUpSkill):
    """Its bounds may be above its true costs, as a shortcut's may."""

    def lower_bound(self, state, objects):
        return max(self.least_steps, int(self.tightness * self.true_cost(state)))


@settings(max_examples=400, deadline=None)
@given(
    made_up_graphs(),
    st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8), st.integers(0, 10**6)), max_size=10),
    st.integers(1, 60),
    st.floats(0.0, 5.0),
)
def test_shortcuts_never_make_a_plan_longer_whatever_their_bounds(graph, ends, least, tightness):
    without = cost_or_none(search_lazily, graph)
    for number, (i, j, seed) in enumerate(ends):
        if max(i, j) < len(graph.nodes) and i not in graph.goal_nodes:
            skill = WronglyBoundedSkill(f"x{number}", seed, tightness, least_steps=least)
            graph.edges.append(Edge(i, j, in_ways(skill, 2)))
    cost = cost_or_none(search_lazily, graph)
    assert without is None or (cost is not None and cost <= without)


class DeadEnd(MadeUpSkill):
    """Leads nowhere: how long it takes need not be known."""

    def lower_bound(self, state, objects):
        raise AssertionError("never asked")


def test_lazy_search_does_not_look_at_dead_ends():
    graph = AbstractGraph(goal=1 << 20, nodes=[1, 2, 3 | 1 << 20], depth=[0] * 3)
    skills = {1: DeadEnd("nowhere", 0, 1.0), 2: MadeUpSkill("there", 0, 1.0)}
    for target, skill in skills.items():
        graph.edges.append(Edge(0, target, Option(OptionKind.OPERATOR, skill, ())))
    model = MadeUpModel()
    plan = search_lazily(graph, State(LAYOUT, [0.0]), model).plan
    assert plan is not None
    assert [edge.option.skill.name for edge in plan.edges] == ["there"]
    assert model.executed == 1


def brute_force(graph, model):
    """The cheapest of all paths, by trying every one."""
    forward, goals = graph.forward_edges(), set(graph.goal_nodes)

    def best(node, state):
        if node in goals:
            return 0
        costs = []
        for edge in forward[node]:
            option = edge.option
            while option is not None:
                rollout = model.roll_out(option, state, edge.target)
                if not rollout.reached:
                    break
                rest = best(edge.target, rollout.final)
                if rest is not None:
                    costs.append(rollout.steps + rest)
                option = option.next_attempt()
        return min(costs, default=None)

    return best(0, State(LAYOUT, [0.0]))


@settings(max_examples=200, deadline=None)
@given(made_up_graphs())
def test_exhaustive_search_finds_the_best_of_all_paths(graph):
    assert cost_or_none(search_exhaustively, graph) == brute_force(graph, MadeUpModel())


@pytest.mark.timeout(180)  # the slow one plans for 50 tasks twice
@pytest.mark.parametrize(
    "indices",
    [range(50), pytest.param(range(50, 100), marks=pytest.mark.slow)],
    ids=["50 tasks", "50 more"],
)
def test_lazy_equals_exhaustive_with_at_most_half_the_rollouts(indices):
    domain = get_domain("obstacle2d")
    rollouts = {"lazy": 0, "exhaustive": 0}
    for index in indices:
        task = domain.task(1000, index)
        goal = domain.atom_space(task.initial_state).mask(task.goal)
        costs = set()
        for name in rollouts:
            result = make_planner(name, domain, task.initial_state).plan(task.initial_state, goal)
            rollouts[name] += result.edges_rolled_out
            costs.add(result.plan.predicted_steps)
        assert len(costs) == 1, f"task {index}: {costs}"
    assert rollouts["lazy"] <= 0.5 * rollouts["exhaustive"], rollouts


def test_graph_of_the_paper_task_is_that_of_the_reference():
    """8 nodes, 12 edges, 21 candidate shortcuts."""
    domain = get_domain("obstacle2d", "paper")
    task = domain.task(0)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    graph = build_abstract_graph(
        space.abstract(task.initial_state), space.mask(task.goal), problem.operators
    )
    assert (len(graph.nodes), len(graph.edges), len(graph.candidates())) == (8, 12, 21)


def test_lower_bounds_never_exceed_the_true_steps():
    domain = get_domain("obstacle2d")
    checked = 0
    for seed in range(60):
        task = domain.task(seed)
        problem = Problem.of(domain, task.initial_state)
        model, state = problem.model, task.initial_state
        rng = np.random.default_rng(seed)
        for _ in range(8):
            abstract = model.space.abstract(state)
            choices = [(g, o) for g, o in problem.operators if g.applicable(abstract)]
            ground, option = choices[rng.integers(len(choices))]
            rollout = model.roll_out(option, state, Target.exactly(ground.apply(abstract)))
            if not rollout.reached:
                break
            assert option.skill.lower_bound(state, option.objects) <= rollout.steps
            assert option.skill.least_steps <= rollout.steps
            state = rollout.final
            checked += 1
    assert checked > 300


def test_an_unreachable_goal_is_unsolvable_and_a_node_limit_is_kept():
    domain = get_domain("obstacle2d")
    task = domain.task(0)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    start = space.abstract(task.initial_state)
    both = space.mask([space.atom("Holding", ["robot", b]) for b in ("block1", "block2")])
    with pytest.raises(UnsolvableError, match="none of the"):
        build_abstract_graph(start, both, problem.operators)
    with pytest.raises(PlanningLimitError, match="more than 3 abstract states"):
        build_abstract_graph(start, space.mask(task.goal), problem.operators, max_nodes=3)


def test_a_goal_that_already_holds_needs_no_plan():
    domain = get_domain("obstacle2d")
    task = domain.task(0)
    space = domain.atom_space(task.initial_state)
    goal = space.mask([space.atom("GripperEmpty", ["robot"])])
    for name in ("lazy", "exhaustive", "ff"):
        result = make_planner(name, domain, task.initial_state).plan(task.initial_state, goal)
        assert result.plan.edges == ()


@st.composite
def graphs_with_shortcuts(draw):
    """Options with admissible bounds, and shortcuts whose bounds may exceed what they take."""
    graph = draw(made_up_graphs())
    size = len(graph.nodes)
    sources = [i for i in range(size) if i not in graph.goal_nodes]
    pairs = st.tuples(st.sampled_from(sources), st.integers(1, size - 1))
    for number, (i, j) in enumerate(draw(st.lists(pairs, max_size=8))):
        tightness = draw(st.sampled_from([0.5, 1.0, 2.0, 5.0]))
        skill = MadeUpSkill(f"shortcut{number}", draw(st.integers(0, 10**6)), tightness)
        graph.edges.append(Edge(i, j, in_ways(skill, draw(st.integers(1, 3)))))
    return graph


@settings(max_examples=200, deadline=None)
@given(graphs_with_shortcuts())
def test_a_plan_is_too_long_by_no_more_than_bounds_are_too_high(graph):
    state, model = State(LAYOUT, [0.0]), MadeUpModel()
    best = search_exhaustively(graph, state, model).plan
    if best is None:
        return
    lazy = search_lazily(graph, state, model).plan
    assert lazy is not None
    excess = 0
    for edge in best.edges:
        rollout = model.roll_out(edge.option, state, edge.target)
        excess += max(0, edge.option.skill.lower_bound(state, ()) - rollout.steps)
        state = rollout.final
    assert best.predicted_steps <= lazy.predicted_steps <= best.predicted_steps + excess
