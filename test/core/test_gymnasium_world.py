# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gymnasium environments as worlds, and the example domain that is one."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slap_ros.core.gymnasium_world import GymnasiumWorld, state_of
from slap_ros.errors import InvalidCommandError, InvalidDomainError, InvalidStateError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.relational import State

EXAMPLE = Path(__file__).parents[2] / "examples" / "marbles"
marbles = pytest.importorskip("marbles")
from marbles.environment import MarblesEnv  # noqa: E402

DOMAIN = marbles.make("fair")
TASK = DOMAIN.task(0)


class Drifting(MarblesEnv):
    """Begins elsewhere than where it is reset to."""

    def reset(self, **arguments):
        observation, info = super().reset(**arguments)
        self._state["hand"] += 1e-9
        return observation | {"hand": self._state["hand"]}, info


class Blind(MarblesEnv):
    """Does not see the second marble once it moved."""

    def step(self, action):
        observation, *rest = super().step(action)
        del observation["marble2"]
        return observation, *rest


class Terse(MarblesEnv):
    """Does not tell how high the hand is."""

    def step(self, action):
        observation, *rest = super().step(action)
        return observation | {"hand": observation["hand"][:2]}, *rest


def world(kind, state=TASK.initial_state):
    return GymnasiumWorld(kind(), state, DOMAIN.action_space)


def random_actions(count, seed=0):
    space = DOMAIN.action_space
    return np.random.default_rng(seed).uniform(space.low, space.high, (count, len(space.low)))


def test_what_comes_next_depends_on_the_state_alone():
    played = world(MarblesEnv)
    states = [played.state, *(played.step(action) for action in random_actions(200))]
    elsewhere = world(MarblesEnv)
    for i in np.random.default_rng(1).permutation(200):
        elsewhere.reset(states[i])
        after = elsewhere.step(random_actions(200)[i])
        np.testing.assert_array_equal(after.data, states[i + 1].data)


def test_a_state_that_was_told_is_never_changed_afterwards():
    played = world(MarblesEnv)
    states = [played.step(action) for action in random_actions(20)]
    copies = [state.data.copy() for state in states]
    for action in random_actions(20, seed=1):
        played.step(action)
    for state, copy in zip(states, copies, strict=True):
        np.testing.assert_array_equal(state.data, copy)


def test_an_environment_that_does_not_begin_where_it_is_told_to_is_refused():
    with pytest.raises(InvalidDomainError, match=r"hand is .*must continue from it exactly"):
        world(Drifting)


@pytest.mark.parametrize(
    ("kind", "words"),
    [(Blind, "observes hand, marble1, marble3; the objects are"), (Terse, r"hand with shape \(2,")],
)
def test_observations_that_do_not_fit_the_objects_are_refused(kind, words):
    with pytest.raises(InvalidDomainError, match=words):
        world(kind).step(np.zeros(4))


def test_what_the_environment_refuses_is_an_invalid_state():
    data = TASK.initial_state.data.copy()
    data[0] = 2.0
    with pytest.raises(InvalidStateError, match=r"refuses this state: .*unit square"):
        world(MarblesEnv, State(TASK.initial_state.layout, data))


def test_commands_are_checked_before_the_environment_sees_them():
    played = world(MarblesEnv)
    with pytest.raises(InvalidCommandError, match="command x"):
        played.step(np.array([0.2, 0.0, 0.0, 0.0]))
    assert played.state is TASK.initial_state


def test_the_broom_sweeps_several_marbles_where_the_skills_take_one():
    """Otherwise the example's shortcut would not be there to be found."""
    task = marbles.make("paper").task(0)
    played = world(MarblesEnv, task.initial_state)
    for action in [[0, 0, -0.1, -1]] * 2 + [[0.1, 0, 0, -1]] * 9:
        state = played.step(np.array(action, dtype=float))
    assert all(atom.holds(state) for atom in task.goal)
    assert state_of(state.layout, {o.name: state[o] for o in state.layout.objects}) == state


@pytest.mark.parametrize("seed", range(5))
def test_the_example_is_solved_by_planning(seed):
    task = DOMAIN.task(seed)
    episode = solve(DOMAIN, task, PURE_PLANNING)
    assert episode.success
    assert episode.replans == 0


@pytest.mark.slow
@pytest.mark.timeout(180)  # builds a distribution, and installs it
def test_once_installed_the_example_is_a_domain_like_others(tmp_path):
    """By its entry point alone, in a process that never heard of it."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--no-build-isolation", "--target", str(tmp_path), str(EXAMPLE)]
    subprocess.run(command, check=True, timeout=200)
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-m", "ensemble.cli", "evaluate", "marbles", "--tasks", "2"]
    command += ["--seeds", "1", "--jobs", "1", "--shortcuts", "none", "--json"]
    output = subprocess.run(
        command, check=True, timeout=200, capture_output=True, text=True, env=environment
    )
    assert json.loads(output.stdout)["success_rate"] == 1.0
