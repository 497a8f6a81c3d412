# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pushes are true, and bodies behave: nothing tunnels, sinks, explodes or creeps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.physics_step import NAMES, SCENE, pushes, tower, truth, with_joints
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.joint_space.arm import Arm
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, FLOOR_TOP, TABLE, TABLE_TOP, cube
from slap_ros.worlds.joint_space.simulation import Simulation, Stepping
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_OPEN, HOME, MAX_STEP
from support.transitions import HIGH, holding

PUSHES = 25  # of the 200 that benchmarks/physics_step.py --pushes 200 compares
FASTEST = 6.0  # m/s; falling to the floor gives 3
DEEPEST = 0.022  # m; a body may be let go of 2 cm inside the table


def blocks(state) -> np.ndarray:
    return np.array([state[state.layout.object(name)] for name in NAMES])


def box_of(row) -> OrientedBox:
    return cube("any").at(Pose(tuple(row[:3].tolist()), tuple(row[3:7].tolist())))


@pytest.mark.slow
@pytest.mark.timeout(180)  # a reference in much finer steps
def test_pushes_agree_with_the_fine_reference_at_least_as_often_as_plain_stepping():
    figures = truth(PUSHES)
    assert figures["ours_agrees"] >= figures["plain_agrees"]
    assert figures["ours_agrees"] > 0.85
    assert abs(figures["ours_bottom_bias_cm"]) < abs(figures["plain_bottom_bias_cm"])


def require_sound(state) -> None:
    """No body is faster than it can be, or inside another."""
    rows = blocks(state)
    assert np.isfinite(state.data).all()
    assert np.abs(rows[:, 7:10]).max() < FASTEST
    boxes = [box_of(row) for row in rows]
    obstacles = [body.at(body.pose) for body in SCENE.fixed]
    for i, box in enumerate(boxes):
        assert box.pose.position[2] > FLOOR_TOP
        if rows[i, 13] > 0.5:
            continue
        core = box.shrunk(DEEPEST / 2)
        assert not any(obstacle.shrunk(DEEPEST / 2).overlaps(core) for obstacle in obstacles)
        for j in range(i):
            if rows[j, 13] < 0.5:
                assert not core.overlaps(boxes[j].shrunk(DEEPEST / 2))


def test_nothing_tunnels_sinks_or_explodes_however_wild_the_arm(world):
    rng = np.random.default_rng(5)
    moved = 0
    for number, push in enumerate(pushes(40, seed=8)):
        start = with_joints(tower(), push.joints)
        if number % 2:
            start = holding(tower(), "T", tuple(push.joints.tolist()))
        world.reset(start)
        for _ in range(5):
            habit = rng.uniform(-HIGH, HIGH)
            for _ in range(8):
                action = np.clip(0.7 * habit + 0.5 * rng.uniform(-HIGH, HIGH), -HIGH, HIGH)
                action[7] = rng.choice([-1.0, 0.0, 0.0, 0.0, 1.0])
                require_sound(world.step(action))
                world.reset(world.state)  # what a world makes, it accepts
        moved += bool(np.abs(blocks(world.state)[:, :3] - blocks(start)[:, :3]).max() > 0.01)
    assert moved > 20


def test_what_was_pushed_lies_on_the_table_or_on_the_floor(world):
    for push in pushes(20, seed=9):
        world.reset(with_joints(tower(), push.joints))
        for action in push.actions:
            world.step(action)
        for _ in range(40):
            state = world.step(np.zeros(8))
        for row in blocks(state):
            over_table = abs(row[0] - 0.5) < 0.25 and abs(row[1]) < 0.4
            ground = TABLE_TOP if over_table else FLOOR_TOP
            assert row[2] > ground + CUBE_EDGE / 2 - 1.5e-3


def test_a_tower_left_alone_stands_for_ever(world):
    before = world.state
    for _ in range(500):
        assert world.step(np.zeros(8)) == before


def test_a_tower_stands_while_the_arm_moves_about_elsewhere(world):
    before = blocks(world.state)
    rng = np.random.default_rng(2)
    for _ in range(10):
        world.reset(tower())
        for _ in range(20):
            state = world.step(rng.uniform(-HIGH, HIGH))
        assert np.array_equal(blocks(state), before)


def test_driven_links_arrive_where_they_are_sent():
    """To a hundredth of a millimetre, over the longest way, with nothing to push."""
    simulation = Simulation(SCENE, Stepping())
    away = [BodyState(Pose((-1.0 - i, 0.0, 1.0))) for i in range(len(NAMES))]
    start = Arm.at(HOME, FINGER_OPEN)
    end = Arm.at(np.add(HOME, MAX_STEP).tolist(), FINGER_OPEN)
    drives = [Drive.between(a, b) for a, b in zip(start.links, end.links, strict=True)]
    simulation.run(away, None, drives)
    for body, pose in zip(simulation._links, end.links, strict=True):
        position, quaternion = pybullet.getBasePositionAndOrientation(body, simulation.client)
        assert position == pytest.approx(pose.position, abs=1e-5)
        assert pose.angle_to(Pose(position, quaternion)) < 1e-5
    simulation.close()


@pytest.mark.parametrize(("x", "falls"), [(0.72, False), (0.77, True)])
def test_a_block_over_the_edge_of_the_table_falls_and_one_on_it_stays(x, falls):
    state = tower()
    block = state.layout.object("T")
    with PandaWorld(SCENE, state.replace({(block, "x"): x})) as world:
        for _ in range(16):
            after = world.step(np.zeros(8))
    assert (after.get(block, "z") < TABLE.pose.position[2]) == falls


def test_a_block_put_in_mid_air_falls_though_it_has_no_velocity():
    state = tower()
    block = state.layout.object("T")
    with PandaWorld(SCENE, state.replace({(block, "z"): 0.3})) as world:
        assert world.step(np.zeros(8)).get(block, "z") < 0.25
        for _ in range(10):
            after = world.step(np.zeros(8))
    assert after.get(block, "z") == pytest.approx(0.1, abs=1e-3)
    assert not after[block][7:13].any()
