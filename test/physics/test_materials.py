# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mass and friction are what the state says, at once and without a trace."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.physics_step import NAMES, SCENE, reach, tower
from slap_ros.errors import InvalidStateError
from slap_ros.relational import State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.joint_space.scene import CUBE_MATERIAL, REFERENCE_FRICTION, TABLE, Scene, cube
from slap_ros.worlds.joint_space.simulation import GRAVITY, SIMULATIONS
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import HOME
from support.materials import tower_of
from support.transitions import GRASP, holding

STAY = np.zeros(8)


def steps(world: PandaWorld, state: State, count: int) -> State:
    world.reset(state)
    for _ in range(count):
        state = world.step(STAY)
    return state


def shoved(friction: float, mass: float = 0.5, at: float = 1.0) -> State:
    """Block T slides along the table at so many m/s in y; what it might meet is far away."""
    state = tower_of({"T": Material(mass, friction)})
    block = state.layout.object("T")
    return state.replace({(block, "vy"): at, (block, "y"): -0.35})


@pytest.fixture
def world():
    with PandaWorld(SCENE, tower_of({})) as world:
        yield world


def slide(world: PandaWorld, state: State) -> float:
    block = state.layout.object("T")
    return float(steps(world, state, 16).get(block, "y") - state.get(block, "y"))


@pytest.mark.parametrize("mass", [0.05, 0.5, 5.0])
def test_a_block_slides_as_far_as_coulomb_says_whatever_its_mass(world, mass):
    for friction in (0.3, 0.4):
        way = 0.6**2 / (2 * friction * REFERENCE_FRICTION * GRAVITY)
        assert slide(world, shoved(friction, mass, at=0.6)) == pytest.approx(way, rel=0.15)


def test_a_block_on_ice_does_not_stop(world):
    assert slide(world, shoved(0.0, at=0.2)) == pytest.approx(0.2 * 2.0, rel=0.05)


def test_a_heavy_block_hits_harder(world):
    def travelled(mass: float) -> float:
        """How far a block of 0.5 kg goes that is hit by one of that mass."""
        state = tower_of({"T": Material(mass, 0.3), "B": Material(0.5, 0.3)})
        t, b = state.layout.object("T"), state.layout.object("B")
        changes = {(t, "x"): 0.3, (t, "y"): 0.2, (t, "vx"): 0.8}
        changes |= {(b, "x"): 0.4, (b, "y"): 0.2}
        lone = {(state.layout.object(n), "y"): -0.3 - 0.06 * i for i, n in enumerate(NAMES[2:])}
        lone |= {(state.layout.object(n), "z"): 0.1 for n in NAMES[2:]}
        after = steps(world, state.replace(changes | lone), 10)
        return float(after.get(b, "x")) - 0.4

    light, equal, heavy = (travelled(mass) for mass in (0.05, 0.5, 5.0))
    assert 0.0 < light < equal / 2 < equal < heavy / 1.5


def test_a_held_block_is_as_rough_as_the_state_says(world):
    def dragged(friction: float) -> float:
        """How far a light block goes over which a held one is drawn, slightly pressing it."""
        joints = reach(np.array([0.5, -0.2, 0.148]), 0.0, np.array(HOME))
        state = tower_of({"T": Material(0.5, friction), "B": Material(0.05, 0.1)})
        state = holding(state, "T", tuple(joints.tolist()))
        blocks = {name: state.layout.object(name) for name in NAMES}
        changes = {(blocks["B"], "x"): 0.5, (blocks["B"], "y"): -0.2}
        changes |= {(blocks["C"], "z"): 0.1, (blocks["D"], "z"): 0.15}
        world.reset(state.replace(changes))
        point = np.array([0.5, -0.2, 0.148])
        for _ in range(3):
            point = np.add(point, (0.0, 0.01, 0.0))
            after = reach(point, 0.0, joints)
            state, joints = world.step(np.array([*(after - joints), 0.0])), after
        return float(state.get(blocks["B"], "y")) + 0.2

    assert GRASP.position[2] > 0.1  # the held block is below the hand
    rough, smooth = dragged(1.5), dragged(0.0)
    assert rough > 0.01
    assert abs(smooth) < 0.002
    assert dragged(1.5) == rough  # the hand forgot what it held between


def test_a_world_takes_on_the_masses_and_frictions_of_each_state(world):
    """Whatever it was reset to before, in one client and in a fresh one."""
    states = [shoved(0.2, 0.3), shoved(0.7, 3.0), shoved(0.9, 0.5), shoved(0.2, 0.1)]
    fresh = []
    for state in states:
        SIMULATIONS.forget()
        with PandaWorld(SCENE, state) as other:
            fresh.append(steps(other, state, 6))
    assert len({state.key for state in fresh}) == len(states)
    for i in np.random.default_rng(0).integers(0, len(states), 20):
        assert steps(world, states[i], 6) == fresh[i]


@pytest.mark.parametrize("material", [CUBE_MATERIAL, Material(0.3, 0.37)])
def test_the_same_numbers_in_the_scene_and_in_the_state_are_the_same_physics(material):
    scene = Scene((TABLE, *(cube(name).with_material(material) for name in NAMES)))
    features = ["x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "wz"]

    def thrown(state: State) -> State:
        changes = {"z": 0.3, "vy": 0.5, "wx": 3.0, "wz": 1.0}
        block = state.layout.object("T")
        return state.replace({(block, name): value for name, value in changes.items()})

    with PandaWorld(scene, tower()) as said_by_scene:
        one = steps(said_by_scene, thrown(tower()), 6)
    said = tower_of(dict.fromkeys(NAMES, material))
    with PandaWorld(SCENE, tower_of({})) as said_by_state:
        other = steps(said_by_state, thrown(said), 6)
    for name in NAMES:
        for feature in features:
            a, b = (s.get(s.layout.object(name), feature) for s in (one, other))
            assert a == b


@pytest.mark.parametrize(
    ("material", "words"),
    [
        (Material(0.0, 0.9), "mass of B is 0.0 kg"),
        (Material(-1.0, 0.9), "mass of B is -1.0 kg"),
        (Material(0.5, -0.1), "friction of B is -0.1"),
        (Material(float("nan"), 0.9), "not finite"),
    ],
)
def test_what_nothing_is_made_of_is_refused(world, material, words):
    before = world.state
    block = before.layout.object("B")
    values = zip(("mass", "friction"), material, strict=True)
    bad = before.replace({(block, name): value for name, value in values})
    with pytest.raises(InvalidStateError, match=words):
        world.reset(bad)
    assert world.state is before
    with pytest.raises(InvalidStateError, match=words):
        PandaWorld(SCENE, bad)
