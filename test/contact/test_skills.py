# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction alone holds what is grasped; drawers, lids and holes do what theirs do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.contact_skills import (
    CLEARANCES_MM,
    GRASPABLE,
    INSERTED,
    LID_SHUT,
    OPEN,
    SHUT,
    drawer_opened,
    drawer_shut,
    grasped_world,
    inserted_depth,
    lid_shut,
    shaken_slip,
)
from benchmarks.workbench import LOOSE, Move, Setting, perform, position, start, value
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.contact.contacts import Side
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.world import ContactWorld


@pytest.mark.parametrize("name", GRASPABLE)
def test_what_is_grasped_is_held_while_shaken(name):
    for seed in range(4):
        with grasped_world(name, seed) as world:
            assert value(world.state, name, "held") == 1.0
            assert position(world.state, name)[2] > 0.15
            assert shaken_slip(world, name, seed) < 0.005


def test_both_fingers_press_with_the_force_that_they_have():
    with grasped_world("cube", 0) as world:
        forces = {Side.LEFT_FINGER: 0.0, Side.RIGHT_FINGER: 0.0}
        for point in world.contacts:
            for surface in (point.first, point.second):
                if surface.side in forces:
                    forces[surface.side] += point.force_n
    grip = world.scene.hand.grip_n
    assert forces == {side: pytest.approx(grip, rel=0.1) for side in forces}


def test_a_grasp_is_no_attachment():
    """What is held by one side of its weight only turns; what is let go falls."""
    with grasped_world("rod", 0) as world:
        there = tuple(position(world.state, "robot").tolist())
        state = perform(world, [Move(there, 12)])
        assert value(state, "rod", "held") == 0.0
        assert position(state, "rod")[2] == pytest.approx(0.012, abs=1e-3)


def test_closing_beside_a_thing_holds_nothing():
    beside = Setting(hand=hand_at((0.45, 0.1, 0.07)))
    with ContactWorld(LOOSE, start(beside, LOOSE)) as world:
        state = perform(world, [Move((0.45, 0.1, 0.07), 8, close=True)])
    assert value(state, "cube", "held") == 0.0
    assert value(state, "robot", "left_finger") == pytest.approx(0.0, abs=1e-6)
    assert (position(state, "cube") == Setting().cube.position).all()


def test_fingers_close_with_limited_speed():
    with ContactWorld(LOOSE, start(scene=LOOSE)) as world:
        for _ in range(4):
            before = value(world.state, "robot", "left_finger")
            world.step(np.array([0.0, 0.0, 0.0, 0.0, 1.0]))
            assert before - value(world.state, "robot", "left_finger") <= 0.15 * 0.05 + 1e-9


def test_drawers_open_by_their_handles_and_shut(world):
    for seed in range(4):
        assert drawer_opened(world, np.random.default_rng(seed)) >= OPEN
        assert drawer_shut(world) < SHUT


def test_a_thing_in_a_drawer_goes_with_it(world):
    """It is carried by friction, and pushed by the drawer's back where that does not do."""
    inside = Setting(hand=hand_at((0.66, 0.25, 0.25)), openings=(0.15, 0.0, 0.3))
    cube = Pose((0.55, 0.25, 0.06))
    world.reset(start(Setting(inside.hand, cube, openings=inside.openings)))
    for _ in range(10):
        state = world.step(np.zeros(5))
    rests = position(state, "cube")
    assert rests[2] == pytest.approx(0.04, abs=2e-3)
    # The drawer is shut by its front, from where the hand has come down before it.
    away = Setting(
        hand=hand_at((0.33, 0.25, 0.09), 0.5 * math.pi, finger=0.0, closing=True),
        cube=Pose(tuple(rests.tolist())),
        openings=inside.openings,
    )
    world.reset(start(away))
    state = perform(world, [Move((0.55, 0.25, 0.06), 30, close=True, yaw=0.5 * math.pi)])
    moved = 0.15 - value(state, "left", "opening")
    assert moved > 0.1
    assert position(state, "cube")[0] - rests[0] > 0.05


def test_lids_shut(world):
    for seed in range(4):
        assert lid_shut(world, np.random.default_rng(seed)) < LID_SHUT


@pytest.mark.parametrize("clearance", CLEARANCES_MM)
def test_a_rod_goes_into_a_hole(clearance):
    for seed in range(2):
        assert inserted_depth(clearance, seed) >= INSERTED


def test_a_rod_does_not_go_through_a_wall():
    """A hole narrower than the rod lets nothing in, however long it is pushed."""
    assert inserted_depth(-2.0, 0, steps=60) < 0.003
