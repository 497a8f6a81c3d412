# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulator with a hidden warm start is not Markov; rebuilt in each step, it is."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.core.rebuild_each_step import RebuildEachStep
from slap_ros.domain_check import check_domain
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import Obstacle2DWorld
from slap_ros.errors import InvalidCommandError, InvalidStateError
from slap_ros.relational import State

DOMAIN = get_domain("obstacle2d")
ACTIONS = DOMAIN.action_space
TASK = DOMAIN.task(0)


class WarmStarted(Obstacle2DWorld):
    """Begins a step with a thousandth of the last one's motion, as engines do with impulses."""

    def __init__(self, state):
        super().__init__(state)
        self.impulse = 0.0

    def step(self, action):
        state = super().step(action)
        robot = state.layout.object("robot")
        moved = state.replace({(robot, "x"): float(state.get(robot, "x")) + 1e-3 * self.impulse})
        self.impulse = float(action[0])
        return moved


REBUILT = RebuildEachStep.maker(WarmStarted, ACTIONS)


def markov(make_world):
    domain = replace(DOMAIN, make_world=make_world)
    found = {check.name: check for check in check_domain(domain, task_count=1, state_count=60)}
    return found["Markov"]


def test_a_hidden_warm_start_fails_the_check_and_passes_it_when_rebuilt():
    running_on = markov(WarmStarted)
    assert running_on.status == "problem"
    assert "robot.x" in running_on.found
    assert markov(REBUILT).status == "ok"


def test_what_a_step_does_depends_on_no_step_before():
    rng = np.random.default_rng(0)
    actions = rng.uniform(ACTIONS.low, ACTIONS.high, (50, len(ACTIONS.low)))
    world = REBUILT(TASK.initial_state)
    states = [world.state, *(world.step(action) for action in actions)]
    other = REBUILT(TASK.initial_state)
    for i in rng.permutation(50):
        other.reset(states[i])
        np.testing.assert_array_equal(other.step(actions[i]).data, states[i + 1].data)


def test_each_step_costs_one_building_and_a_reset_before_it_none():
    built = []

    def make(state):
        built.append(state)
        return WarmStarted(state)

    world = RebuildEachStep(make, TASK.initial_state, ACTIONS)
    for _ in range(3):
        world.step(np.zeros(len(ACTIONS.low)))
    world.reset(TASK.initial_state)
    world.step(np.zeros(len(ACTIONS.low)))
    assert len(built) == 4
    assert built[0] is built[3] is TASK.initial_state


def test_a_command_out_of_range_moves_nothing():
    world = REBUILT(TASK.initial_state)
    with pytest.raises(InvalidCommandError, match="is not within"):
        world.step(np.full(len(ACTIONS.low), 100.0))
    assert world.state is TASK.initial_state
    assert world.step(np.zeros(len(ACTIONS.low))) is world.state


def test_a_state_that_cannot_be_is_refused_at_the_reset():
    data = TASK.initial_state.data.copy()
    data[0] = np.nan
    world = REBUILT(TASK.initial_state)
    with pytest.raises(InvalidStateError):
        world.reset(State(TASK.initial_state.layout, data))
    assert world.state is TASK.initial_state
