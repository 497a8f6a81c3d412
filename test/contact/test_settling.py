# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is measured a little off its place is put where physics accepts it, and stays there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.contact_skills import GRASPABLE, HOLE_Z, PLATE_FACE
from benchmarks.workbench import (
    BENCH,
    CUBE,
    CUBE_AT,
    LEFT_DRAWER,
    LYING,
    ROD,
    ROD_AT,
    THING,
    Move,
    Setting,
    holed_plate,
    perform,
    position,
    start,
)
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Pose, from_rotation_vector, from_yaw, multiply
from slap_ros.relational import State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.scene import TABLE, ContactScene, box
from slap_ros.worlds.contact.settling import settled
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.features import POSE_FEATURES, body_features

NOISE, TURN_NOISE = 0.002, 0.01  # m, rad: standard deviations
AWAY = hand_at((0.45, 0.0, 0.35))
HOLD = np.array([0.0, 0.0, 0.0, 0.0, -1.0])


def measured(state: State, rng: np.random.Generator) -> State:
    """The state as a camera sees it."""
    changes = {}
    for obj in state.objects:
        if "held" in obj.type.column and not state.get(obj, "held") > 0.5:
            for axis in "xyz":
                changes[obj, axis] = float(state.get(obj, axis)) + NOISE * rng.standard_normal()
            old = tuple(float(state.get(obj, f"q{axis}")) for axis in "xyzw")
            turn = from_rotation_vector(tuple(TURN_NOISE * rng.standard_normal(3)))
            new = multiply(turn, old)
            changes |= {(obj, f"q{axis}"): v for axis, v in zip("xyzw", new, strict=True)}
    return state.replace(changes)


def in_drawer() -> tuple[ContactScene, State]:
    """The drawer is open, the cube lies in its corner, the rod leans on nothing."""
    x, y, z = LEFT_DRAWER.pose.position
    corner = Pose((x - 0.14 - 0.098 + 0.004 + 0.021, y + 0.074 - 0.021, z - 0.014 + 0.02))
    state = start(Setting(hand=AWAY, cube=corner, openings=(0.14, 0.0, 1.2)))
    return BENCH, state


def in_hole(clearance_m: float) -> tuple[ContactScene, State]:
    """The rod lies in the hole of a plate."""
    half = 0.012 + 0.5 * clearance_m
    scene = ContactScene((TABLE, ROD, holed_plate(half, z=HOLE_Z)))
    rod = Pose((PLATE_FACE + 0.03, 0.0, HOLE_Z - 0.5 * clearance_m), LYING)
    robot = {ROBOT("robot"): robot_features(AWAY)}
    return scene, State.build({**robot, THING("rod"): body_features(*rod)})


def stacked() -> tuple[ContactScene, State]:
    """Three cubes on one another, each turned and shifted."""
    names = ("low", "middle", "high")
    cubes = [box(name, (0.02, 0.02, 0.02), mass_kg=0.1) for name in names]
    features = {ROBOT("robot"): robot_features(AWAY)}
    for i, name in enumerate(names):
        pose = Pose((0.5 + 0.006 * i, 0.004 * i, 0.02 + 0.04 * i), from_yaw(0.4 * i))
        features[THING(name)] = body_features(*pose)
    return ContactScene((TABLE, *cubes)), State.build(features)


def side_by_side() -> tuple[ContactScene, State]:
    """A rod that has rolled against a cube, and a hammer across them on the table."""
    hammer = GRASPABLE["hammer"]
    scene = ContactScene((TABLE, CUBE, ROD, hammer.body))
    rolled = multiply(from_rotation_vector((0.7, 0.0, 0.0)), ROD_AT.quaternion)
    features = {
        ROBOT("robot"): robot_features(AWAY),
        THING("cube"): body_features(*Pose((0.5, 0.032, 0.02))),
        THING("rod"): body_features((0.5, 0.0, 0.012), rolled),
        THING("hammer"): body_features((0.5, -0.15, hammer.height)),
    }
    return scene, State.build(features)


PLACES = {
    "drawer": in_drawer(),
    "hole, 8 mm": in_hole(0.008),
    "hole, 3 mm": in_hole(0.003),
    "stack": stacked(),
    "side by side": side_by_side(),
}


@pytest.mark.parametrize("place", PLACES)
def test_what_rests_still_does(place):
    scene, state = PLACES[place]
    rng = np.random.default_rng(len(place))
    with ContactWorld(scene, state) as world:
        for _ in range(25):
            seen = settled(scene, measured(state, rng))
            world.reset(seen)
            for _ in range(3):
                after = world.step(HOLD)
            for obj in (o for o in state.objects if "held" in o.type.column):
                moved = math.dist(position(after, obj.name), position(seen, obj.name))
                assert moved < 0.001, f"{obj.name} moved by {moved} m"
                off = math.dist(position(seen, obj.name), position(state, obj.name))
                assert off < 5.0 * NOISE
                velocity = [float(after.get(obj, f"v{axis}")) for axis in "xyz"]
                assert velocity == [0.0, 0.0, 0.0]


def test_what_is_held_or_moves_is_where_it_was():
    x, y, _ = CUBE_AT.position
    with ContactWorld(BENCH, start(Setting(hand=hand_at((x, y, 0.06))))) as world:
        moves = [Move(CUBE_AT.position, 6), Move(CUBE_AT.position, 6, close=True)]
        held = perform(world, [*moves, Move((x, y, 0.12), 6, close=True)])
        cube = held.layout.object("cube")
        assert held.get(cube, "held") > 0.5
        poses = [feature.name for feature in POSE_FEATURES]
        seen = settled(BENCH, held)
        assert [seen.get(cube, f) for f in poses] == [held.get(cube, f) for f in poses]
        falling = perform(world, [Move((x, y, 0.12), 2)])
        assert settled(BENCH, falling)[cube].tolist() == falling[cube].tolist()


def test_a_thing_between_open_fingers_is_not_in_them():
    rng = np.random.default_rng(1)
    wide = box("plank", (0.05, 0.037, 0.02), mass_kg=0.1)  # 3 mm of room on either side
    scene = ContactScene((TABLE, wide))
    features = {
        ROBOT("robot"): robot_features(hand_at((0.5, 0.0, 0.02))),
        THING("plank"): body_features((0.5, 0.0, 0.02)),
    }
    state = State.build(features)
    with ContactWorld(scene, state) as world:
        for _ in range(25):
            seen = settled(scene, measured(state, rng))
            world.reset(seen)
            after = world.step(HOLD)
            assert math.dist(position(after, "plank"), position(seen, "plank")) < 0.001


def test_a_state_that_is_right_stays_as_it_is():
    for scene, state in PLACES.values():
        assert np.abs(settled(scene, state).data - state.data).max() < 1e-9


def test_what_moves_is_in_nothing_either_and_stays_as_it_is_turned():
    state = start(Setting(hand=AWAY))
    cube = state.layout.object("cube")
    inside = state.replace({(cube, "vx"): 0.3, (cube, "z"): 0.005})
    with ContactWorld(BENCH, state) as world:
        with pytest.raises(InvalidStateError, match="inside one another"):
            world.reset(inside)
        seen = settled(BENCH, inside)
        world.reset(seen)
    assert seen.get(cube, "z") == pytest.approx(0.02)
    assert seen.get(cube, "vx") == 0.3
    above = state.replace({(cube, "vx"): 0.3, (cube, "z"): 0.03})
    assert settled(BENCH, above).get(cube, "z") == 0.03  # nothing says that it lies on the table
