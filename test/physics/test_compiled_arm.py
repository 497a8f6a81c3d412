# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arm by compiled code is that of plain floats to the bit; what stays clear is not computed."""

import numpy as np
import pytest

from benchmarks.physics_step import SCENE, pushes, reach, tower, with_joints
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, normalised
from slap_ros.worlds.joint_space import arm as plain
from slap_ros.worlds.joint_space.arm import POSTURE_AT, Arm, Obstacle, Surroundings
from slap_ros.worlds.joint_space.scene import cube
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import FINGER_OPEN, HOME, JOINT_HIGH, JOINT_LOW, MAX_STEP, grasp_pose

pytest.importorskip("numba")
from slap_ros.worlds.joint_space.compiled_arm import CompiledArm


def random_turn(rng):
    return normalised(tuple(rng.normal(size=4).tolist()))


def random_ways(rng, count):
    """Two configurations a step apart, the fingers, and what is held, for both kinds of arm."""
    for number in range(count):
        start = rng.uniform(JOINT_LOW, JOINT_HIGH) if number % 3 else rng.normal(HOME, 0.25)
        step = rng.uniform(-1.0, 1.0, 7) * MAX_STEP * (number % 5 > 0)
        place = rng.normal((0.0, 0.0, 0.1), 0.02)
        grasp = Pose(tuple(place.tolist()), random_turn(rng))
        held = cube("B") if number % 2 else None
        with_hand = rng.uniform(0.0, FINGER_OPEN), held, grasp
        yield start.tolist(), (start + step).tolist(), with_hand


def test_compiled_code_finds_the_same_to_the_bit():
    rng = np.random.default_rng(0)
    answers = []
    for start, end, with_hand in random_ways(rng, 300):
        arms = Arm.at(start, *with_hand), Arm.at(end, *with_hand)
        compiled = CompiledArm(start, *with_hand), CompiledArm(end, *with_hand)
        assert [arm.links for arm in compiled] == [arm.links for arm in arms]
        middle = arms[1].centres[rng.integers(4, len(arms[1].centres))]
        boxes = Surroundings(
            OrientedBox(
                Pose(tuple((middle + rng.normal(0.0, 0.12, 3)).tolist()), random_turn(rng)),
                tuple(rng.uniform(0.01, 0.1, 3).tolist()),
            )
            for _ in range(rng.integers(1, 4))
        )
        obstacles = Surroundings(map(Obstacle.of, boxes))
        way, other = arms[0].to(arms[1]), compiled[0].to(compiled[1])
        answer = way.stays_clear(boxes), way.hits(obstacles)
        assert (other.stays_clear(boxes), other.hits(obstacles)) == answer
        assert other.deepest_penetration(obstacles) == way.deepest_penetration(obstacles)
        assert other.drives() == way.drives()
        answers.append(answer)
    assert {clear for clear, _ in answers} == {hit for _, hit in answers} == {True, False}


def outcomes(states, actions, monkeypatch, posture_at):
    """The next states of some states and actions, by one kind of arm."""
    monkeypatch.setattr(POSTURE_AT, "_chosen", posture_at)
    monkeypatch.setattr(POSTURE_AT, "_rows_left", 0)
    with PandaWorld(SCENE, tower()) as world:
        found = []
        for state, action in zip(states, actions, strict=True):
            world.reset(state)
            found.append(world.step(action).key)
    return found


def beside_a_block(rng, count):
    """States with the hand over or beside the tower, and steps that begin there."""
    for _ in range(count):
        place = np.array((0.5, 0.0, 0.23)) + rng.uniform((-0.08, -0.09, 0.0), (0.08, 0.09, 0.06))
        found = reach(place, rng.uniform(-0.5, 0.5), np.array(HOME))
        if found is None:
            continue
        position = np.array(grasp_pose(found).position) + rng.uniform(-0.02, 0.02, 3)
        after = reach(position, 0.0, found)
        if after is not None and (np.abs(after - found) <= MAX_STEP).all():
            yield with_joints(tower(), found.tolist()), np.array([*(after - found), 0.0])


def test_a_step_that_stays_clear_is_the_one_that_physics_computes(monkeypatch):
    """However finely it is looked whether the arm stays clear: the states are the same."""
    rng = np.random.default_rng(3)
    states, actions = zip(*beside_a_block(rng, 150), strict=True)
    fine = outcomes(states, actions, monkeypatch, CompiledArm)
    assert outcomes(states, actions, monkeypatch, Arm.at) == fine
    monkeypatch.setattr(plain, "SPACINGS", (0.01,))
    assert outcomes(states, actions, monkeypatch, Arm.at) == fine
    monkeypatch.setattr(plain, "CLEARANCE", 0.2)  # physics computes them all
    assert outcomes(states, actions, monkeypatch, Arm.at) == fine


def test_pushes_are_the_same_by_both(monkeypatch):
    for push in pushes(3, seed=5):
        ends = []
        for posture_at in (Arm.at, CompiledArm):
            monkeypatch.setattr(POSTURE_AT, "_chosen", posture_at)
            monkeypatch.setattr(POSTURE_AT, "_rows_left", 0)
            with PandaWorld(SCENE, with_joints(tower(), push.joints.tolist())) as world:
                ends.append([world.step(action).key for action in push.actions])
        assert ends[0] == ends[1]
