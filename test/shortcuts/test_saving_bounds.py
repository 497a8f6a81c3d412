# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut saves at most is what plans save once an option without steps is in the graph."""

import math
from dataclasses import replace

import pytest

from slap_ros.planning.abstract_graph import Edge, build_abstract_graph
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.saving_bounds import saving_bounds
from slap_ros.shortcuts.way_on import steps_to_goal
from slap_ros.skills.scripted_skill import with_scripts
from support.points import POINTS

STEPS = {"Pick": 10.0, "Put": 20.0}
FREE = "Free"


@pytest.fixture(scope="module")
def graph():
    domain = with_scripts(POINTS)
    task = domain.task(0, 0)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    return build_abstract_graph(start, goal, problem.operators)


def with_free_option(graph, i, j):
    """The graph with one more option, which takes no steps."""
    option = graph.edges[0].option
    free = replace(option, skill=replace(option.skill, name=FREE))
    return replace(graph, edges=[*graph.edges, Edge(i, j, free)])


def test_no_pair_saves_more_or_less_than_a_free_option_between_its_states(graph):
    plan = steps_to_goal(graph, STEPS)[0]
    assert plan == 60.0  # two points are picked and put
    bounds = {bound.pair: bound for bound in saving_bounds(graph, STEPS)}
    for pair in graph.candidates():
        free = steps_to_goal(with_free_option(graph, *pair), STEPS | {FREE: 0.0})[0]
        saved = bounds[pair].saving if pair in bounds else 0.0
        assert saved == plan - free, pair


def test_bounds_say_which_operators_a_shortcut_replaces_and_what_these_take(graph):
    bounds = saving_bounds(graph, STEPS)
    first = bounds[0]
    assert (first.saving, first.steps) == (60.0, 60.0)
    assert first.replaced == ("Pick", "Put", "Pick", "Put")
    for bound in bounds:
        if math.isfinite(bound.steps):
            assert bound.steps == sum(STEPS[name] for name in bound.replaced)
            assert bound.saving <= bound.steps
        else:
            assert bound.replaced == ()
    assert sorted(bounds, key=lambda bound: -bound.saving) == bounds


def test_an_operator_that_was_never_executed_counts_as_the_others_do(graph):
    known = {"Pick": 10.0}
    assert saving_bounds(graph, known)[0].saving == 40.0
