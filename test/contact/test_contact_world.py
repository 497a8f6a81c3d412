# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands, limits, what is left out, and states that cannot be."""

from __future__ import annotations

import gc
import math

import numpy as np
import pytest

from benchmarks.contact_skills import grasped_world, in_hand
from benchmarks.workbench import (
    BENCH,
    CUBE,
    HANDLE_AT,
    LOOSE,
    LYING,
    Setting,
    hand_of,
    lid,
    position,
    start,
    value,
)
from slap_ros.errors import InvalidCommandError, InvalidDomainError, InvalidStateError
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import State
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.contact.arm import MAX_JOINT_STEP
from slap_ros.worlds.contact.contacts import Side
from slap_ros.worlds.contact.features import robot_features
from slap_ros.worlds.contact.hand import LEASH, hand_at
from slap_ros.worlds.contact.hand_model import HandModel
from slap_ros.worlds.contact.scene import TABLE, ContactScene, box, cylinder
from slap_ros.worlds.contact.simulation import SIMULATIONS
from slap_ros.worlds.contact.world import ACTION_SPACE, MAX_SHIFT, MAX_TURN, ContactWorld
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, grasp_pose
from support.states import changed

STAY = np.zeros(5)


# -- commands ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([0.0, 0.0, 0.0, 0.0], "5 entries"),
        ([0.0] * 6, "5 entries"),
        ([[0.0] * 5], "5 entries"),
        ([], "5 entries"),
        ([math.nan, 0.0, 0.0, 0.0, 0.0], "command x = nan"),
        ([0.0, math.inf, 0.0, 0.0, 0.0], "command y = inf"),
        ([0.0, 0.0, -0.021, 0.0, 0.0], "command z = -0.021"),
        ([0.0, 0.0, 0.0, 0.151, 0.0], "command yaw = 0.151"),
        ([0.0, 0.0, 0.0, 0.0, 1.1], "command gripper = 1.1"),
    ],
)
def test_commands_that_are_refused(world, action, message):
    before = world.state
    with pytest.raises(InvalidCommandError, match=message):
        world.step(np.array(action))
    assert world.state is before
    assert world.step(STAY) is not before  # the world is usable afterwards


def test_the_gripper_stays_as_it_was_told(world):
    told = []
    for command in (0.0, 0.6, 0.0, 0.5, -0.5, -0.51, 0.4):
        state = world.step(np.array([0.0, 0.0, 0.0, 0.0, command]))
        told.append(value(state, "robot", "gripper"))
    assert told == [-1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0]


def test_the_target_stays_on_its_leash(world):
    """Whatever the hand is pushed against."""
    world.reset(start(Setting(hand=hand_at((0.45, -0.02, 0.03)))))
    for _ in range(20):
        before = hand_of(world.state)
        state = world.step(np.array([0.0, 0.0, -MAX_SHIFT, MAX_TURN, 0.0]))
        target = [value(state, "robot", f"target_{axis}") for axis in "xyz"]
        assert np.abs(target - before).max() <= LEASH + 1e-12
    assert hand_of(state)[2] == pytest.approx(0.009, abs=1e-3)  # its tips on the table
    assert value(state, "robot", "target_z") == pytest.approx(0.009 - LEASH, abs=1e-3)


def test_the_hand_presses_with_its_force():
    scene = ContactScene(LOOSE.bodies, HandModel(pull_n=25.0))
    with ContactWorld(scene, start(Setting(hand=hand_at((0.45, -0.02, 0.02))), LOOSE)) as world:
        for _ in range(20):
            world.step(np.array([0.0, 0.0, -MAX_SHIFT, 0.0, 0.0]))
        fingers = (Side.LEFT_FINGER, Side.RIGHT_FINGER)
        pressed = [
            p for p in world.contacts if fingers.count(p.first.side) or fingers.count(p.second.side)
        ]
        assert sum(p.force_n for p in pressed) == pytest.approx(25.0, rel=0.05)


# -- the arm ----------------------------------------------------------------------------------


def test_the_arm_follows_the_hand_within_its_limits():
    rng = np.random.default_rng(0)
    with ContactWorld(BENCH, start(Setting(hand=hand_at((0.5, 0.0, 0.1))))) as world:
        for _ in range(400):
            before = world.state
            action = rng.uniform(ACTION_SPACE.low, ACTION_SPACE.high)
            state = world.step(action)
            robot = state.layout.object("robot")
            joints, old = state[robot][:7], before[robot][:7]
            assert (np.abs(joints - old) <= np.array(MAX_JOINT_STEP) + 1e-12).all()
            assert (joints >= JOINT_LOW).all()
            assert (joints <= JOINT_HIGH).all()
            at = grasp_pose(joints.tolist())
            assert math.dist(at.position, hand_of(state)) < 1e-9


def test_a_target_that_the_arm_cannot_reach_is_refused(world):
    for _ in range(60):
        state = world.step(np.array([MAX_SHIFT, 0.0, 0.0, 0.0, 0.0]))
    edge = hand_of(state)
    assert 0.7 < edge[0] < 0.9
    assert value(state, "robot", "target_x") == pytest.approx(edge[0], abs=1e-6)
    for _ in range(8):  # near its end, an arm is slow
        back = world.step(np.array([-MAX_SHIFT, 0.0, 0.0, 0.0, 0.0]))
    assert hand_of(back)[0] < edge[0] - 0.01


def test_the_hand_turns_no_faster_than_joint_7():
    with ContactWorld(LOOSE, start(scene=LOOSE)) as world:
        before = value(world.state, "robot", "joint7")
        state = world.step(np.array([0.0, 0.0, 0.0, MAX_TURN, 0.0]))
        assert abs(value(state, "robot", "joint7") - before) <= MAX_JOINT_STEP[6]
        assert value(state, "robot", "target_yaw") == MAX_TURN  # it goes on turning
        for _ in range(3):
            state = world.step(STAY)
        assert value(state, "robot", "joint7") - before == pytest.approx(-MAX_TURN, abs=1e-3)


# -- what is left out -------------------------------------------------------------------------


def test_only_what_can_be_reached_is_computed(world, monkeypatch):
    computed = []
    run = type(world._dynamics._simulation).run

    def spy(self, now, pull, involved):
        computed.append(involved)
        return run(self, now, pull, involved)

    world.step(STAY)  # whether all bodies stand is now known
    monkeypatch.setattr(type(world._dynamics._simulation), "run", spy)
    world.step(np.array([0.01, 0.0, 0.0, 0.0, 0.0]))
    assert computed == []  # the hand's own way alone
    world.reset(start(Setting(hand=hand_at((0.45, 0.1, 0.03)))))
    world.step(np.array([0.0, 0.0, -0.01, 0.0, 0.0]))
    assert {involved.bodies for involved in computed if involved.hand} == {(0,)}  # the cube


def test_what_is_flung_is_met_by_what_was_left_out():
    """A fast body reaches one that nothing was expected to reach."""
    far = Setting(cube=Pose((0.45, 0.0, 0.02)), rod=Pose((0.45, 0.3, 0.012), LYING))
    with ContactWorld(LOOSE, start(far, LOOSE)) as world:
        world.reset(changed(world.state, "cube", vy=2.5))
        for _ in range(12):
            state = world.step(STAY)
        assert position(state, "rod")[1] > 0.31
        assert position(state, "cube")[1] < position(state, "rod")[1]


def test_the_hands_own_way_is_what_the_simulation_makes_of_it():
    """Where nothing is near, both give the same."""
    from slap_ros.worlds.contact.hand import own_way
    from slap_ros.worlds.contact.involved import Involved
    from slap_ros.worlds.contact.simulation import ContactSimulation
    from slap_ros.worlds.contact.snapshot import ContactSnapshot, Placement

    scene = ContactScene((TABLE,))
    simulation = ContactSimulation(scene)
    simulation.place(Placement(tuple(body.pose for body in scene.fixed), ()))
    rng = np.random.default_rng(0)
    hand = hand_at((0.5, 0.0, 0.3))
    for step in range(60):
        x, y, z = (np.array(hand.pose.position) + rng.uniform(-0.03, 0.03, 3)).tolist()
        hand = hand._replace(
            target=(x, y, z),
            target_yaw=hand.yaw + float(rng.uniform(-0.3, 0.3)),
            closing=step % 20 < 10,
        )
        alone = own_way(hand, hand.target_pose, scene.hand)
        now = ContactSnapshot((0.0,) * 7, hand, (), ())
        full = simulation.run(now, hand.target_pose, Involved()).hand
        assert math.dist(alone.pose.position, full.pose.position) < 3e-5
        assert alone.pose.angle_to(full.pose) < 1e-3
        assert math.dist(alone.fingers, full.fingers) < 5e-4
        hand = full
    simulation.close()


def test_pybullet_took_the_frictions(world):
    """Of calls with several properties it does not, for links."""
    simulation = world._dynamics._simulation
    frictions = {
        surface: pybullet.getDynamicsInfo(*part, simulation.client)[1]
        for part, surface in simulation._sides.items()
    }
    for surface, friction in frictions.items():
        expected = {Side.PALM: 0.9, Side.LEFT_FINGER: 2.0, Side.RIGHT_FINGER: 2.0}
        assert friction == expected.get(
            surface.side, 0.9 if surface.number == 0 and surface.side is Side.FIXED else 1.0
        )


# -- states that cannot be --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "features", "message"),
    [
        ("cube", {"x": math.nan}, "not finite"),
        ("cube", {"qw": 2.0}, "quaternion of cube has length 2"),
        ("rod", {"z": 1e9}, "rod is 1000000000.0 m away"),
        ("cube", {"vx": 1e30}, "cube moves at 1e[+]30 m/s"),
        ("rod", {"wx": -1e6}, "rod moves at 1000000.0 rad/s"),
        ("left", {"opening": 5.0}, "opening of left is 5.0, not within"),
        ("lid", {"opening": -0.1}, "opening of lid is -0.1, not within"),
        ("left", {"opening_velocity": 100.0}, "left moves at 100.0 m/s"),
        ("robot", {"joint3": 3.0}, "joint 3 = 3.0 rad"),
        ("robot", {"joint1": 0.5}, "off from where the arm's joints"),
        ("robot", {"x": 2.0}, "target is 1.5 m away"),
        ("robot", {"x": 2.0, "target_x": 2.0}, "the arm cannot have its hand"),
        ("robot", {"left_finger": 0.2}, "left finger is at 0.2 m"),
        ("robot", {"right_finger": -0.01}, "right finger is at -0.01 m"),
        ("robot", {"gripper": 0.3}, "gripper = 0.3"),
        ("robot", {"target_yaw": 2.0}, "rad off, leash"),
        ("robot", {"qx": 0.8, "qw": 0.6}, "tilted"),
        ("cube", {"z": 0.0}, "inside one another"),
        ("cube", {"x": 0.5, "y": -0.12}, "cube and rod are inside one another|rod and cube"),
        ("cube", {"x": 0.72, "y": 0.25, "z": 0.067}, "inside one another"),  # in a cabinet's top
        ("cube", {"x": 0.5, "y": 0.0, "z": 0.28}, "the hand and cube are inside"),
        ("cube", {"held": 1.0}, "cube is held, but not between the fingers"),
    ],
)
def test_states_that_cannot_be(world, name, features, message):
    before = world.state
    with pytest.raises(InvalidStateError, match=message):
        world.reset(changed(before, name, **features))
    assert world.state is before
    assert world.step(STAY).key != b""  # the world is usable afterwards
    with pytest.raises(InvalidStateError, match=message):
        ContactWorld(BENCH, changed(before, name, **features))


def test_two_held_bodies(world):
    both = changed(changed(world.state, "cube", held=1.0), "rod", held=1.0)
    with pytest.raises(InvalidStateError, match="at most"):
        world.reset(both)


def test_held_is_what_the_fingers_say():
    """A grasp that was made is accepted, a thing beside the fingers is not; nothing else asks."""
    with grasped_world("cube", 1) as world:
        held = world.state
        world.reset(held)
        beside = in_hand(held, "cube").position
        assert max(abs(x) for x in beside) < 0.02
        with pytest.raises(InvalidStateError, match="not between"):
            world.reset(changed(held, "cube", z=value(held, "cube", "z") - 0.08))
        # Not to say that it is held is allowed; the next step sees that it is.
        world.reset(changed(held, "cube", held=0.0))
        assert value(world.step(STAY), "cube", "held") == 1.0


def test_other_objects(world):
    with pytest.raises(InvalidStateError, match="its own objects"):
        world.reset(start(scene=LOOSE))
    with pytest.raises(InvalidStateError, match="'left' is not an object"):
        ContactWorld(BENCH, start(scene=LOOSE))


def test_an_arm_that_cannot_be_there():
    with pytest.raises(InvalidStateError, match="cannot have its hand"):
        robot_features(hand_at((1.5, 0.0, 0.2)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: (CUBE, CUBE), "two bodies named cube"),
        (lambda: (box("b", (0.1, 0.0, 0.1)),), "a part of b reaches 0.0 m"),
        (lambda: (cylinder("c", math.nan, 0.1),), "a part of c reaches nan m"),
        (lambda: (box("b", (0.1,) * 3, mass_kg=-1.0),), "mass of b is -1.0"),
        (lambda: (box("b", (0.1,) * 3, friction=-0.5),), "friction of b is -0.5"),
        (lambda: (box("b", (0.1,) * 3, mass_kg=1.0, solid=False),), "must be solid"),
        (lambda: (_lid(high=0.0),), "opens to 0.0"),
        (lambda: (_lid(axis=(0.0, 2.0, 0.0)),), "not of length 1"),
        (lambda: (_lid(damping=-1.0),), "below 0"),
    ],
)
def test_scenes_that_cannot_be(make, message):
    with pytest.raises(InvalidDomainError, match=message):
        ContactScene(make())


def _lid(**changes):
    from dataclasses import replace

    body = lid("lid", Pose())
    return replace(body, joint=replace(body.joint, **changes))


def test_forces_that_cannot_be():
    with pytest.raises(InvalidDomainError, match="pull_n must be above 0, not -1"):
        ContactScene((CUBE,), HandModel(pull_n=-1.0))


def test_random_garbage(world):
    """Any state is refused by a named error or stepped; the world is usable afterwards."""
    rng = np.random.default_rng(0)
    fine = world.state
    accepted = 0
    for _ in range(400):
        data = fine.data.copy()
        for i in rng.integers(data.size, size=rng.integers(1, 4)):
            scale = 10.0 ** rng.uniform(-4, 6)
            data[i] = rng.choice(
                [np.nan, np.inf, rng.normal(0, scale), data[i] + rng.normal(0, 1e-3)]
            )
        try:
            world.reset(State(fine.layout, data))
        except InvalidStateError as error:
            assert str(error)
        else:
            accepted += 1
            for _ in range(3):
                state = world.step(rng.uniform(ACTION_SPACE.low, ACTION_SPACE.high))
                assert np.isfinite(state.data).all()
    assert 10 < accepted < 390
    world.reset(fine)
    first = world.step(STAY)
    with ContactWorld(BENCH, fine) as other:
        assert other.step(STAY) == first


def test_every_state_that_a_world_makes_is_accepted():
    rng = np.random.default_rng(5)
    hand = hand_at((HANDLE_AT[0], HANDLE_AT[1], 0.12), 0.5 * math.pi)
    turned = Pose((0.46, 0.12, 0.1), from_yaw(0.5))
    with ContactWorld(BENCH, start(Setting(hand=hand, cube=turned))) as world:
        for _ in range(300):
            action = rng.uniform(ACTION_SPACE.low, ACTION_SPACE.high) - [0, 0, 0.004, 0, 0]
            world.step(np.clip(action, ACTION_SPACE.low, ACTION_SPACE.high))
            world.reset(world.state)


# -- clients ----------------------------------------------------------------------------------


def test_worlds_of_a_scene_share_a_client_that_goes_with_them():
    SIMULATIONS.forget()
    worlds = [ContactWorld(LOOSE, start(scene=LOOSE)) for _ in range(3)]
    (client,) = {world._dynamics._simulation.client for world in worlds}
    worlds[0].close()
    with pytest.raises(ValueError, match="closed"):
        worlds[0].step(STAY)
    SIMULATIONS.forget()
    worlds[1].step(STAY)  # those that are there go on
    assert pybullet.isConnected(client)
    del worlds
    gc.collect()
    assert not pybullet.isConnected(client)
