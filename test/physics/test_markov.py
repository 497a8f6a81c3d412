# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state is all there is: the same state and action give the same next state, bit for bit."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from benchmarks.physics_step import BLOCK, NAMES, SCENE, tower
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State, Type
from slap_ros.worlds.features import POSE_FEATURES, pose_features
from slap_ros.worlds.joint_space.scene import TABLE, Box, Scene
from slap_ros.worlds.joint_space.simulation import SIMULATIONS
from slap_ros.worlds.joint_space.world import PandaWorld
from support.marks import slow
from support.programs import environment, program
from support.transitions import Transitions, record

COUNTS = {"alike": 400, "mixed": 400, "toys": 160}  # toys have many pieces


@pytest.fixture(scope="module", params=["alike", *slow("mixed", "toys")])
def transitions(request) -> Transitions:
    return record(COUNTS[request.param], seed=1, kind=request.param)


@pytest.fixture
def world(transitions):
    with PandaWorld(transitions.scene, transitions.start) as world:
        yield world


def test_the_pairs_are_taken_in_the_thick_of_it(transitions):
    states = State(transitions.start.layout, transitions.before)
    blocks = [states[states.layout.object(name)] for name in NAMES]
    after = State(transitions.start.layout, transitions.after)
    moving = np.max([np.abs(block[:, 7:13]).max(1) for block in blocks], axis=0) > 0.02
    shifted = np.max(
        [
            np.abs(after[after.layout.object(name)][:, :3] - block[:, :3]).max(1)
            for name, block in zip(NAMES, blocks, strict=True)
        ],
        axis=0,
    )
    held = np.max([block[:, 13] for block in blocks], axis=0) > 0.5
    assert len(transitions.before) == COUNTS[transitions.kind]
    assert moving.mean() > 0.2
    assert ((shifted > 1e-3) & ~held).mean() > 0.3
    assert held.mean() > 0.1


def test_the_same_after_any_other_history(transitions, world):
    for seed in range(2):
        order = np.random.default_rng(seed).permutation(len(transitions.before))
        assert transitions.differing(world, order) == []


def test_the_same_in_fresh_worlds(transitions):
    for i in range(0, len(transitions.before), 50):
        SIMULATIONS.forget()  # a new PyBullet client each time
        with PandaWorld(transitions.scene, transitions.start) as world:
            assert transitions.differing(world, [i]) == []


def test_the_same_in_another_process(transitions, tmp_path):
    transitions.save(tmp_path / "transitions.npz")
    answer = subprocess.run(
        [*program("transitions"), tmp_path / "transitions.npz"],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"0 of {len(transitions.before)} differ" in answer.stdout


def test_a_world_goes_on_as_one_that_was_reset_to_its_state(transitions, world):
    """Nothing is carried from step to step but the state."""
    with PandaWorld(transitions.scene, transitions.start) as other:
        for start in range(0, len(transitions.before), 40):
            state = transitions.state(start)
            world.reset(state)
            for action in transitions.actions[start : start + 8]:
                other.reset(state)
                state = world.step(action)
                assert other.step(action) == state


def test_fixed_bodies_that_the_state_places_leave_no_trace():
    shelf = Type("shelf", POSE_FEATURES)("shelf")
    scene = Scene((TABLE, Box("shelf", (0.1, 0.1, 0.01)), *SCENE.free))
    base = tower()

    def with_shelf(x: float) -> State:
        features = {
            obj: {f.name: float(base.get(obj, f.name)) for f in obj.type.features}
            for obj in base.objects
        }
        block = base.layout.object("T")
        features[block] |= {"x": 0.4, "y": 0.25, "z": 0.3}
        return State.build({**features, shelf: pose_features(Pose((x, 0.25, 0.2)))})

    under, aside = with_shelf(0.4), with_shelf(0.6)
    with PandaWorld(scene, under) as world:

        def drop(state: State) -> State:
            world.reset(state)
            for _ in range(8):
                state = world.step(np.zeros(8))
            return state

        first, other = drop(under), drop(aside)
        block = BLOCK("T")
        assert first.get(block, "z") == pytest.approx(0.235, abs=1e-3)
        assert other.get(block, "z") == pytest.approx(0.1, abs=1e-3)
        for _ in range(3):
            assert drop(under) == first
            assert drop(aside) == other
