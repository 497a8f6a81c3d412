# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A world may end in a state in which it cannot begin, as with a hand that presses."""

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidStateError, UnsolvableError
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem

DOMAIN = get_domain("obstacle2d", "fair")
TASK = DOMAIN.task(3)


@pytest.fixture
def refused(monkeypatch):
    """A problem, and the keys of the states that its world refuses to begin in."""
    problem, keys = Problem.of(DOMAIN, TASK.initial_state), set()
    world = problem.model._world
    reset = world.reset

    def picky(state):
        if state.key in keys:
            raise InvalidStateError("the hand is pressed in")
        reset(state)

    monkeypatch.setattr(world, "reset", picky)
    return problem, keys


def plan(problem):
    goal = problem.model.space.mask(TASK.goal)
    return GraphPlanner(problem).plan(TASK.initial_state, goal).plan


def test_where_a_roll_out_ended_and_nothing_can_begin_another_one_fails(refused):
    problem, keys = refused
    first, second = plan(Problem.of(DOMAIN, TASK.initial_state)).edges[:2]
    end = problem.model.roll_out(first.option, TASK.initial_state, first.target).final
    keys.add(end.key)
    after = problem.model.roll_out(second.option, end, second.target)
    assert (after.reached, after.steps) == (False, 0)
    assert after.result.code is ErrorCode.INVALID_STATE
    assert "pressed in" in after.result.reason
    with pytest.raises(UnsolvableError, match="pressed in"):
        plan(problem)


def test_a_state_that_nothing_led_to_is_refused(refused):
    problem, keys = refused
    keys.add(TASK.initial_state.key)
    with pytest.raises(InvalidStateError, match="pressed in"):
        plan(problem)
