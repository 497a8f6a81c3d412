# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state is all there is: the same state and action give the same next state, bit for bit."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from benchmarks.workbench import BENCH, start
from slap_ros.relational import State
from slap_ros.worlds.contact.simulation import SIMULATIONS
from slap_ros.worlds.contact.world import ContactWorld
from support.contact_transitions import Transitions, record
from support.marks import slow
from support.programs import environment, program

COUNT = 600


@pytest.fixture(scope="module")
def recorded() -> Transitions:
    return record(COUNT, seed=1)


@pytest.fixture
def world():
    SIMULATIONS.forget()  # a new PyBullet client for each order
    with ContactWorld(BENCH, start()) as world:
        yield world


def test_the_steps_are_taken_in_the_thick_of_it(recorded):
    before = State(start().layout, recorded.before)
    after = State(start().layout, recorded.after)
    layout = before.layout

    def get(states, name, feature):
        return states.get(layout.object(name), feature)

    assert len(recorded.before) == COUNT
    assert (get(after, "cube", "held") > 0.5).mean() > 0.05
    assert (get(after, "rod", "held") > 0.5).mean() > 0.05
    assert (np.abs(get(after, "left", "opening_velocity")) > 1e-3).mean() > 0.05
    assert (np.abs(get(after, "lid", "opening_velocity")) > 1e-3).mean() > 0.02
    moving = [np.abs(after[layout.object(name)][:, 7:13]).max(1) > 0.02 for name in ("cube", "rod")]
    assert np.logical_or(*moving).mean() > 0.2
    lag = [get(after, "robot", f"target_{x}") - get(after, "robot", x) for x in "xyz"]
    assert (np.abs(lag).max(0) > 0.01).mean() > 0.03  # something stops the hand


@pytest.mark.parametrize("order", ["backwards", *slow("forwards", 0)])
def test_the_same_in_any_order(recorded, world, order):
    steps = {"forwards": range(COUNT), "backwards": range(COUNT - 1, -1, -1)}.get(order)
    if steps is None:
        steps = np.random.default_rng(order).permutation(COUNT)
    assert recorded.differing(world, steps) == []


@pytest.mark.slow
def test_the_same_in_worlds_of_their_own(recorded):
    for i in range(0, COUNT, 6):
        SIMULATIONS.forget()
        with ContactWorld(BENCH, start()) as world:
            assert recorded.differing(world, [i]) == []


@pytest.mark.slow
def test_the_same_in_another_process(recorded, tmp_path):
    recorded.save(tmp_path / "steps.npz")
    answer = subprocess.run(
        [*program("contact_transitions"), tmp_path / "steps.npz"],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"0 of {COUNT} differ" in answer.stdout


def test_a_world_goes_on_as_one_that_was_reset_to_its_state(recorded, world):
    """Nothing is carried from step to step but the state."""
    with ContactWorld(BENCH, start()) as other:
        for begin in range(0, COUNT, 40):
            state = recorded.state(begin)
            world.reset(state)
            for action in recorded.actions[begin : begin + 20]:
                other.reset(state)
                state = world.step(action)
                assert other.step(action) == state
