# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run may plan again and again: what is kept of earlier plans is limited, and changes nothing."""

from slap_ros.domains import get_domain
from slap_ros.planning import model
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem

DOMAIN = get_domain("obstacle2d", "fair")


def states(count=12):
    """States of the same objects."""
    first = DOMAIN.task(3).initial_state
    found = (DOMAIN.task(3, index).initial_state for index in range(200))
    same = [state for state in found if state.layout == first.layout]
    return same[:count]


def test_as_many_roll_outs_are_kept_as_said_and_plans_are_the_same(monkeypatch):
    starts = states()
    problem = Problem.of(DOMAIN, starts[0])
    goal = problem.model.space.mask(DOMAIN.task(3).goal)
    monkeypatch.setattr(model, "MOST_KEPT", 5)
    for planner in (AnytimePlanner(problem), GraphPlanner(problem)):
        for state in starts:
            plan = planner.plan(state, goal).plan
            assert len(problem.model._cache) <= 5
            fresh = Problem.of(DOMAIN, state)
            assert GraphPlanner(fresh).plan(state, goal).plan.predicted_steps == (
                plan.predicted_steps
            )
    assert problem.model.executed > 5 * len(starts)
