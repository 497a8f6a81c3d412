# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing is flung about, nothing goes through a table, nothing at rest moves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.contact_skills import grasped_world, inserted_depth
from benchmarks.workbench import (
    BENCH,
    LOOSE,
    LYING,
    Setting,
    hand_of,
    position,
    start,
    value,
)
from slap_ros.geometry.pose import Pose, from_yaw, multiply
from slap_ros.relational import State
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.world import ACTION_SPACE, MAX_SHIFT, ContactWorld

STEPS = 500
FASTEST = 3.0  # m/s
TABLE_EDGES = (0.15, 0.95, -0.5, 0.5)  # m: x and y of the table
PRESS = np.array([0.0, 0.0, -MAX_SHIFT, 0.0, 0.0])


def speed(state: State, name: str) -> float:
    return math.hypot(*(value(state, name, f"v{axis}") for axis in "xyz"))


def require_sane(state: State) -> None:
    """Slow, and no body inside the table or below it while it is over it."""
    for name in ("cube", "rod"):
        if name not in state.layout.by_name:
            continue
        assert speed(state, name) < FASTEST
        x, y, z = position(state, name)
        low_x, high_x, low_y, high_y = TABLE_EDGES
        if low_x < x < high_x and low_y < y < high_y:
            assert z > 0.008  # the least that any of their sides is from their middle, less 4 mm
    for jointed, lever in (("left", 1.0), ("right", 1.0), ("lid", 0.08)):
        if jointed in state.layout.by_name:
            assert abs(value(state, jointed, "opening_velocity")) * lever < FASTEST


@pytest.mark.parametrize("seed", range(3))
def test_a_dropped_body(seed):
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    cube = Pose((0.45, 0.1, 0.35), tuple(turn.tolist()))
    rod = Pose((0.6, -0.15, 0.3), multiply(from_yaw(float(rng.uniform(-3, 3))), LYING))
    with ContactWorld(BENCH, start(Setting(cube=cube, rod=rod))) as world:
        for _ in range(STEPS):
            state = world.step(np.zeros(5))
            require_sane(state)
        assert speed(state, "cube") == 0.0
        assert speed(state, "rod") == 0.0


@pytest.mark.parametrize("off", [0.0, 0.012, 0.02, 0.028])
def test_a_pressed_body(off):
    """The closed fingers press a cube onto the table: on its middle, off it, at its edge."""
    hand = hand_at((0.45 + off, 0.1, 0.06), finger=0.0, closing=True)
    with ContactWorld(BENCH, start(Setting(hand=hand))) as world:
        for _ in range(STEPS):
            require_sane(world.step(PRESS))
        assert hand_of(world.state)[2] > 0.005


@pytest.mark.slow
def test_a_jammed_body():
    """A rod that is pushed against a plate, and one held across that is pushed onto the table."""
    inserted_depth(-2.0, 1, steps=100)
    with grasped_world("rod", 3) as world:
        for _ in range(STEPS):
            require_sane(world.step(PRESS))


def test_a_cube_jammed_in_a_drawer(world):
    """It stands out of the drawer when that is pushed shut, hard."""
    inside = Pose((0.56, 0.25, 0.04), from_yaw(0.4))
    hand = hand_at((0.34, 0.25, 0.06), 0.5 * math.pi, finger=0.0, closing=True)
    world.reset(start(Setting(hand=hand, cube=inside, openings=(0.16, 0.0, 0.3))))
    for _ in range(STEPS):
        require_sane(world.step(np.array([MAX_SHIFT, 0.0, 0.0, 0.0, 0.0])))


@pytest.mark.parametrize("seed", range(2))
def test_random_motion(seed):
    rng = np.random.default_rng(seed)
    hand = hand_at((0.47, 0.05, 0.06))
    with ContactWorld(BENCH, start(Setting(hand=hand))) as world:
        low, high = ACTION_SPACE.low, ACTION_SPACE.high
        for _ in range(STEPS):
            action = rng.uniform(low, high) - [0.0, 0.0, 1e-3, 0.0, 0.0]  # it stays near the table
            require_sane(world.step(np.clip(action, low, high)))


def test_what_is_left_alone_stays_to_the_bit(world):
    begin = world.state
    names = ("cube", "rod", "left", "right", "lid")
    for _ in range(STEPS):
        state = world.step(np.array([0.0, 0.0, 0.002, 0.0, 0.0]))
    for name in names:
        obj = begin.layout.object(name)
        assert state[obj].tobytes() == begin[obj].tobytes()


def test_what_came_to_rest_stays_to_the_bit():
    """After a fall, whatever the hand does elsewhere."""
    cube = Pose((0.45, 0.1, 0.15), from_yaw(0.3))
    rng = np.random.default_rng(0)
    with ContactWorld(LOOSE, start(Setting(cube=cube), LOOSE)) as world:
        for _ in range(40):
            rested = world.step(np.zeros(5))
        obj = rested.layout.object("cube")
        for _ in range(STEPS):
            action = [*rng.uniform(-0.01, 0.01, 2), 0.0, *rng.uniform(-0.1, 0.1, 1), 0.0]
            assert world.step(np.array(action))[obj].tobytes() == rested[obj].tobytes()


def test_a_body_in_mid_air_falls():
    """Without velocity, it is not at rest."""
    cube = Pose((0.45, 0.1, 0.3))
    with ContactWorld(LOOSE, start(Setting(cube=cube), LOOSE)) as world:
        state = world.step(np.zeros(5))
    assert value(state, "cube", "z") < 0.3
    assert value(state, "cube", "vz") < -0.4


def test_a_rolling_rod_comes_to_rest():
    """PyBullet's cylinders gain speed as they roll, if nothing is done about it."""
    with ContactWorld(LOOSE, start(scene=LOOSE)) as world:
        rod = world.state.layout.object("rod")
        rolling = {(rod, "vy"): -0.1, (rod, "wx"): 0.1 / 0.012}
        world.reset(world.state.replace(rolling))
        speeds = [speed(world.step(np.zeros(5)), "rod") for _ in range(60)]
    assert max(speeds) < 0.11
    assert speeds[-1] == 0.0
