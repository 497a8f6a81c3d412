# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is proven of plans where the graph is too large: no search of a whole graph is below it."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.domains import get_domain
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.effort import Effort
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.landmark_cut import LandmarkCut, RelaxedOperator
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan_proof import PlanProof, least_steps_in_plans
from slap_ros.planning.potential import LeastSteps, alternate
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import build_bottom_level
from slap_ros.relational import GroundOperator, State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library
from support.cheapest_plans import cheapest
from support.marks import slow
from test.planning.test_anytime_made_up import LIFTED, WORLD, MadeUpModel, Skill, made_up, plan

NOT_ALTERNATING = (
    89,
    173,
    403,
    684,
    1137,
    1389,
)  # where some plan is longer than the graph is deep
MASKS = st.sets(st.integers(0, 4), max_size=2).map(lambda bits: sum(1 << bit for bit in bits))


@st.composite
def problems_with_deletes(draw):
    """Operators, and now and then one of which only is known what it may add."""
    operators = draw(
        st.lists(
            st.tuples(MASKS, MASKS, st.integers(1, 5), st.none() | MASKS), min_size=1, max_size=9
        )
    )
    return draw(MASKS), draw(MASKS), [RelaxedOperator(*one) for one in operators]


def outcomes(one, state):
    """What may come of an operator: where little is known, any part of what it may add."""
    if one.deletes is not None:
        return [state & ~one.deletes | one.add_effects]
    return [state | one.add_effects, one.add_effects, state & ~1, 0]


@settings(max_examples=400, deadline=None)
@given(problems_with_deletes())
def test_a_potential_never_counts_more_than_the_cheapest_plan(problem):
    start, goal, operators = problem
    truth, bound = cheapest(start, goal, operators, outcomes), LeastSteps(goal, operators)(start)
    if truth is not None:
        assert bound <= truth


def test_a_hand_that_must_be_emptied_counts_as_often_as_it_is_filled():
    """Three things to put away by one hand: LM-cut alone counts one place for all of them."""
    empty, goal = 1, 0b1110
    operators = []
    for number in range(1, 4):
        held, away = 1 << number + 3, 1 << number
        operators += [RelaxedOperator(empty, held, 3, empty), RelaxedOperator(held, away, 2, held)]
    places = [one if one.deletes == empty else place(one, empty) for one in operators]
    assert LandmarkCut(goal, places)(empty) == 3 * 3 + 3 * 2  # each place is a landmark here
    cleared = 1 << 10  # where only the picks are needed, the places between them are as well
    picks = [
        RelaxedOperator(one.preconditions, one.add_effects, one.least_steps, one.deletes)
        for one in places
    ]
    last = RelaxedOperator(0b1110000 | empty, cleared, 1, 0)
    assert LandmarkCut(cleared, [*picks, last])(empty) == 3 * 3 + 1
    assert LeastSteps(cleared, [*picks, last])(empty) == 3 * 3 + 3 * 2 + 1


def place(one, empty):
    return RelaxedOperator(one.preconditions, one.add_effects | empty, 2, one.deletes)


def made_up_hand(seed):
    """A problem in which each operator fills or empties the one hand."""
    rng = random.Random(seed)
    empty, full, failing = 1, 2, rng.choice([0.0, 0.2])

    def mask(most):
        return sum(1 << bit for bit in rng.sample(range(2, 7), rng.randint(0, most)))

    operators = []
    for number in range(rng.randint(6, 14)):
        before, after = [(empty, full), (full, empty)][number % 2]
        added = mask(2)
        ground = GroundOperator(
            LIFTED, (), before | mask(1), after | added, before | mask(1) & ~added
        )
        skill = Skill(f"o{number}", rng.randrange(10**6), rng.randint(1, 5), failing)
        operators.append((ground, Option(OptionKind.OPERATOR, skill, ())))
    start = State(WORLD, [float(empty | mask(1)), 0.0])
    return Problem(MadeUpModel(), tuple(operators)), start, mask(3) or 4


def test_a_search_as_deep_as_the_graph_proves_nothing_above_its_shortest_plan(too_large):
    as_deep, more, sharp = 0, 0, 0
    for seed in range(600):
        problem, start, goal = made_up_hand(seed)
        lazy = plan(GraphPlanner(problem), start, goal)
        found = plan(AnytimePlanner(made_up_hand(seed)[0]), start, goal)
        if lazy is None or found is None:
            continue
        grounds = [ground for ground, _ in problem.operators]
        as_deep += alternate(grounds, problem.model.space.abstract(start))
        assert found.at_least <= lazy.steps
        more += len(lazy.plan.edges) > 2
        sharp += found.at_least == lazy.steps
    assert as_deep > 100
    assert more > 50
    assert sharp > 100


@pytest.mark.parametrize("seed", NOT_ALTERNATING)
def test_a_graph_with_ways_that_are_longer_than_it_is_deep_limits_no_depth(seed, too_large):
    problem, _, start, goal = made_up(seed)
    lazy = plan(GraphPlanner(problem), start, goal)
    found = plan(AnytimePlanner(made_up(seed)[0]), start, goal)
    grounds = [ground for ground, _ in problem.operators]
    assert not alternate(grounds, problem.model.space.abstract(start))
    assert found.at_least <= lazy.steps


@pytest.mark.parametrize("within", [1.1, 1.5, 3.0])
def test_what_is_said_to_be_good_enough_is(within, too_large):
    """The search for plans and proofs in turns, against the shortest plan of the whole graph."""
    good_enough, by_search = 0, 0
    for seed in range(300):
        problem, start, goal = made_up_hand(seed)
        lazy = plan(GraphPlanner(problem), start, goal)
        usual = plan(AnytimePlanner(made_up_hand(seed)[0]), start, goal)
        effort = Effort(rollouts=100, within=within)
        found = plan(AnytimePlanner(made_up_hand(seed)[0], effort=effort), start, goal)
        if lazy is None or found is None:
            continue
        assert found.at_least <= lazy.steps
        if found.bound is not None and found.bound <= within:
            assert found.steps <= within * lazy.steps
            good_enough += 1
        assert executed(problem, found.plan, start) == found.steps
        by_search += found.plan != usual.plan
    assert good_enough > 100
    assert by_search > 10


def executed(problem, made, state):
    """The steps of a plan that reaches all of its targets; else the test fails."""
    steps = 0
    for edge in made.edges:
        rollout = problem.model.roll_out(edge.option, state, edge.target)
        assert rollout.reached
        state, steps = rollout.final, steps + rollout.steps
    return steps


@pytest.mark.parametrize("seed", [300, 301])
@pytest.mark.parametrize("shortcuts", [False, True])
def test_towers_are_never_proven_to_take_longer_than_they_do(seed, shortcuts, too_large):
    domain = get_domain("obstacle_tower", "fair:obstacles=2,distractors=1")
    task = domain.task(seed)
    library = chosen_library("" if shortcuts else "none", domain)
    problem = Problem.of(domain, task.initial_state)
    known = library and GroundedShortcuts(domain, library.shortcuts, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    lazy = GraphPlanner(problem, shortcuts=known).plan(task.initial_state, goal)
    found = AnytimePlanner(problem, known).plan(task.initial_state, goal)
    assert found.at_least <= lazy.steps
    assert found.at_least >= (0.4 if shortcuts else 0.8) * lazy.steps


@pytest.mark.parametrize("name", ["obstacle2d", "obstacle_tower", "cleanup_table"])
def test_shortcuts_begin_where_they_may(name):
    domain = get_domain(name)
    task = domain.task(300)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    known = GroundedShortcuts(domain, chosen_library("", domain).shortcuts, task.initial_state)
    planner = GraphPlanner(problem, shortcuts=known)
    graph = planner.graph(space.abstract(task.initial_state), space.mask(task.goal))
    begin = {edge.source for edge in known.edges(graph)}
    begin |= {edge.source for edge in known.beyond(graph, ())}
    assert begin
    assert all(known.may_begin(graph.nodes[i]) for i in begin)


def tower(seed, preset):
    """A domain, the initial state of a task, its problem and the mask of its goal."""
    domain = get_domain("obstacle_tower", preset)
    task = domain.task(seed)
    problem = Problem.of(domain, task.initial_state)
    return task.initial_state, problem, problem.model.space.mask(task.goal)


@pytest.mark.parametrize(
    ("preset", "seed"), [("fair:obstacles=2,distractors=1", 300), *slow(("fair", 2))]
)
def test_no_rest_of_a_plan_is_said_to_take_longer_than_the_shortest(preset, seed):
    """Exhaustively, from each state in which any path of the graph ends or passes."""
    state, problem, goal = tower(seed, preset)
    graph = GraphPlanner(problem).graph(problem.model.space.abstract(state), goal)
    bottom = build_bottom_level(graph, state, problem.model)
    proof = PlanProof(problem, None, state, goal, 10**6)
    proof.first_options = graph.depth[graph.goal_nodes[0]]
    to_go, checked, share = {}, 0, 0.0
    for key, found in reversed(bottom.successors.items()):  # nodes in order, backwards
        rests = [
            steps + to_go.get(after.key, 0)
            for _, steps, after in found
            if leads(after, to_go, graph)
        ]
        if not rests:
            continue
        to_go[key], node = min(rests), key[0]
        least = proof._steps_to_come(graph.nodes[node], graph.depth[node])
        assert least is not None
        assert least <= to_go[key]
        checked, share = checked + 1, share + least / to_go[key]
    assert checked > 10
    assert share / checked > 0.25


def leads(vertex, to_go, graph):
    """Whether a way to the goal is known from a vertex."""
    return vertex.node in graph.goal_nodes or vertex.key in to_go


@pytest.mark.parametrize(
    ("preset", "seed"), [("fair:obstacles=6", 301), ("fair:distractors=5", 302)]
)
def test_given_skills_take_as_long_as_proofs_say(preset, seed):
    """All that can be done along a plan, but what leads back, rolled out."""
    initial, problem, goal = tower(seed, preset)
    model, state, before = problem.model, initial, None
    followed = []
    for edge in AnytimePlanner(problem, effort=Effort(rollouts=1)).plan(initial, goal).plan.edges:
        abstract = model.space.abstract(state)
        for ground, option in problem.operators:
            target = option.target(ground.apply(abstract))
            if not ground.applicable(abstract) or ground.apply(abstract) == before:
                continue
            rollout = model.roll_out(option, state, target)
            if rollout.reached:
                least = least_steps_in_plans(option.skill, initial, before is not None)
                assert option.skill.least_steps < least <= rollout.steps
                followed += [rollout.steps - least] if before is not None else []
        state, before = model.roll_out(edge.option, state, edge.target).final, abstract
    assert len(followed) > 50
    assert min(followed) <= 4


def test_a_tower_of_eight_is_planned_for_until_a_plan_is_good_enough():
    state, problem, goal = tower(303, "fair:obstacles=8")
    usual = AnytimePlanner(problem, effort=Effort(rollouts=40)).plan(state, goal)
    state, problem, goal = tower(303, "fair:obstacles=8")
    found = AnytimePlanner(problem, effort=Effort(within=1.25)).plan(state, goal)
    assert found.bound <= 1.25 < usual.bound
    assert problem.model.executed <= 250
    assert executed(problem, found.plan, state) == found.steps < usual.steps
