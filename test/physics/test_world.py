# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The world: limits, refused steps, grasping, impossible scenes, simulations shared."""

from __future__ import annotations

import gc
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from benchmarks.physics_step import BLOCK, NAMES, SCENE, pushes, reach, tower, with_joints
from slap_ros.errors import InvalidCommandError, InvalidDomainError, InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State, Type
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.features import body_features
from slap_ros.worlds.joint_space.arm import Arm, Obstacle, Surroundings, Sweep
from slap_ros.worlds.joint_space.features import ROBOT, robot_features
from slap_ros.worlds.joint_space.scene import TABLE, Box, Scene, cube
from slap_ros.worlds.joint_space.simulation import SIMULATIONS
from slap_ros.worlds.joint_space.world import ACTION_SPACE, PandaWorld
from slap_ros.worlds.panda import (
    FINGER_OPEN,
    HOME,
    JOINT_HIGH,
    JOINT_LOW,
    MAX_STEP,
    grasp_pose,
    hand_pose,
)
from slap_ros.worlds.shared_simulations import MOST_KEPT
from support.states import changed
from support.transitions import HIGH, holding

CLOSE, OPEN = np.eye(8)[7], -np.eye(8)[7]
STAY = np.zeros(8)
REBOUND = 2e-3  # m


def joints(state: State) -> np.ndarray:
    return state[state.layout.object("robot")][:7]


def block(state: State, name: str = "T") -> np.ndarray:
    return state[state.layout.object(name)]


def hand_at(point, yaw: float = 0.0) -> State:
    """The tower with the grasp point there, the hand pointing down."""
    found = reach(np.array(point, dtype=float), yaw, np.array(HOME))
    assert found is not None
    return with_joints(tower(), found.tolist())


def move(world: PandaWorld, way, steps: int) -> State:
    """Move the grasp point straight by ``way`` in m, in so many steps."""
    state = world.state
    q = joints(state).copy()
    start = np.array(grasp_pose(q).position)
    for k in range(1, steps + 1):
        after = reach(start + np.array(way) * k / steps, 0.0, q)
        state = world.step(np.array([*(after - q), 0.0]))
        q = after
    return state


# -- limits -------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", range(7))
@pytest.mark.parametrize("sign", [-1, 1])
def test_no_joint_is_faster_than_its_limit(world, axis, sign):
    before = world.state
    action = np.zeros(8)
    action[axis] = sign * MAX_STEP[axis] * 1.001
    with pytest.raises(InvalidCommandError, match=f"joint{axis + 1}"):
        world.step(action)
    assert world.state is before
    action[axis] = sign * MAX_STEP[axis]
    assert joints(world.step(action))[axis] == pytest.approx(HOME[axis] + action[axis])


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ([np.nan, 0, 0, 0, 0, 0, 0, 0], "joint1 = nan rad is not within"),
        ([0, 0, 0, 0, 0, 0, np.inf, 0], "joint7 = inf rad is not within"),
        ([0, 0, 0, 0, 0, 0, 0, 1.5], "gripper = 1.5 1 is not within"),
        ([0, 0, 0], "a command has 8 entries"),
    ],
)
def test_a_bad_command_moves_nothing(world, action, words):
    before = world.state
    with pytest.raises(InvalidCommandError, match=words):
        world.step(np.array(action, dtype=float))
    assert world.state is before


def test_joints_stop_at_their_limits(world):
    up = np.array([MAX_STEP[0], 0, 0, 0, 0, 0, -MAX_STEP[6], 0])
    for _ in range(60):
        state = world.step(up)
    assert joints(state)[0] == JOINT_HIGH[0]
    assert joints(state)[6] == JOINT_LOW[6]


# -- where the arm would enter something --------------------------------------------------------


def test_the_arm_does_not_enter_the_table(world):
    world.reset(hand_at((0.6, 0.25, 0.12)))
    lowest = 1.0
    for _ in range(30):
        q = joints(world.state)
        down = reach(np.array(grasp_pose(q).position) - [0, 0, 0.01], 0.0, q)
        state = world.step(np.array([*(down - q), 0.0]))
        lowest = min(lowest, grasp_pose(joints(state)).position[2])
    tip = lowest - (0.0584 + 0.0539 - 0.1034)
    assert 0.075 - 0.01 <= tip < 0.075  # in contact: at most 1 cm deep, though not less than 0
    assert (
        grasp_pose(joints(move(world, (0, 0, 0.05), 5))).position[2] > lowest + 0.02
    )  # and leaves


def test_the_arm_slides_along_the_table(world):
    """Down and aside: aside it goes, and no deeper."""
    world.reset(hand_at((0.55, 0.2, 0.1)))
    start = np.array(grasp_pose(joints(world.state)).position)
    for _ in range(15):
        q = joints(world.state)
        there = np.array(grasp_pose(q).position)
        on = reach(there - [0, 0.01, 0.01], 0.0, q)
        state = world.step(np.array([*np.clip(on - q, -np.array(MAX_STEP), MAX_STEP), 0.0]))
        assert grasp_pose(joints(state)).position[2] - (0.0584 + 0.0539 - 0.1034) > 0.064
        assert (np.abs(joints(state) - q) <= np.array(MAX_STEP) + 1e-12).all()
    gone = start - grasp_pose(joints(state)).position
    assert gone[1] > 0.09
    assert gone[2] < 0.05


def test_what_is_held_may_reach_two_centimetres_into_the_table(world):
    start = hand_at((0.6, 0.25, 0.2))
    world.reset(holding(tower(), "T", tuple(joints(start).tolist())))
    for _ in range(40):
        q = joints(world.state)
        down = reach(np.array(grasp_pose(q).position) - [0, 0, 0.005], 0.0, q)
        state = world.step(np.array([*(down - q), 0.0]))
    bottom = block(state)[2] - 0.025
    assert 0.075 - 0.02 <= bottom < 0.075 - 0.014
    # Let go, it comes out of the table as far as the palm lets it, and it does not jump.
    highest = block(world.step(OPEN))[2]
    for way in ((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)):
        state = move(world, way, 10)
        highest = max(highest, block(state)[2])
    assert highest < 0.1 + REBOUND
    assert block(state)[2] == pytest.approx(0.1, abs=1e-3)


def test_a_thin_wall_is_not_passed_through():
    wall = Box("wall", (0.2, 0.002, 0.2), pose=Pose((0.5, 0.0, 0.3)))
    aside = reach(np.array([0.5, 0.12, 0.3]), 0.0, np.array(HOME))
    state = State.build({ROBOT("robot"): robot_features(aside.tolist())})
    with PandaWorld(Scene((wall,)), state) as world:
        for _ in range(40):
            world.step(np.array([-MAX_STEP[0], 0, 0, 0, 0, 0, 0, 0]))
        assert grasp_pose(joints(world.state)).position[1] > 0.0


def test_a_block_is_not_pressed_into_the_table(world):
    x, y, z = block(tower())[:3]
    world.reset(hand_at((x, y, z + 0.09), 0.0))
    for _ in range(40):
        q = joints(world.state)
        down = reach(np.array(grasp_pose(q).position) - [0, 0, 0.005], 0.9, q)
        if down is None or np.abs((down - q) / MAX_STEP).max() > 1:
            down = q + np.clip(down - q, -np.array(MAX_STEP), MAX_STEP)
        state = world.step(np.array([*(down - q), 0.0]))
        assert block(state)[2] > 0.1 - 0.008


# -- grasping -----------------------------------------------------------------------------------


def test_grasp_carry_and_release(world):
    x, y, z = block(tower())[:3]
    world.reset(hand_at((x + 0.004, y, z)))
    state = world.step(CLOSE)
    assert block(state)[13] == 1.0
    assert state.get(BLOCK("B"), "held") == 0.0
    robot = state.layout.object("robot")
    assert state.get(robot, "finger") == pytest.approx(0.025, abs=1e-4)
    assert block(state)[:3] == pytest.approx([x, y, z], abs=1e-12)

    state = move(world, (0.0, 0.0, 0.1), 12)
    assert block(state)[:3] == pytest.approx([x, y, z + 0.1], abs=1e-3)
    held_in_hand = (
        hand_pose(joints(state))
        .inverse()
        .compose(Pose(tuple(block(state)[:3]), tuple(block(state)[3:7])))
    )
    assert held_in_hand.position == pytest.approx(state[robot][8:11], abs=1e-12)

    heights = [block(world.step(OPEN))[2]]
    assert block(world.state)[13] == 0.0
    assert world.state.get(robot, "finger") == FINGER_OPEN
    assert np.array_equal(world.state[robot][8:15], [0, 0, 0, 0, 0, 0, 1])
    heights += [block(world.step(STAY))[2] for _ in range(10)]
    assert heights[0] < z + 0.08
    assert heights[-1] == pytest.approx(z, abs=1e-3)
    assert not block(world.state)[7:13].any()


@pytest.mark.parametrize(("off", "held"), [(0.0095, 1.0), (0.0105, 0.0)])
def test_a_grasp_reaches_one_centimetre(world, off, held):
    x, y, z = block(tower())[:3]
    world.reset(hand_at((x + off, y, z)))
    assert block(world.step(CLOSE))[13] == held


def test_the_nearest_body_is_grasped():
    state = State.build(
        {
            ROBOT("robot"): robot_features(joints(hand_at((0.4, 0.0, 0.1))).tolist()),
            BLOCK("a"): body_features((0.394, 0.0, 0.1)),
            BLOCK("b"): body_features((0.405, 0.0, 0.1)),
        }
    )
    thin = [Box(name, (0.005, 0.025, 0.025), mass_kg=0.1) for name in ("a", "b")]
    with PandaWorld(Scene((TABLE, *thin)), state) as world:
        after = world.step(CLOSE)
        assert (after.get(BLOCK("a"), "held"), after.get(BLOCK("b"), "held")) == (0.0, 1.0)
        assert world.step(CLOSE).get(BLOCK("a"), "held") == 0.0  # one at a time


def test_weak_gripper_commands_do_nothing(world):
    world.reset(hand_at(block(tower())[:3]))
    assert block(world.step(0.5 * CLOSE))[13] == 0.0
    world.step(CLOSE)
    assert block(world.step(0.5 * OPEN))[13] == 1.0


def test_a_gripper_that_closes_on_nothing_stays_open(world):
    assert world.step(CLOSE) == tower()


def test_a_held_block_pushes_the_tower_over(world):
    place = hand_at((0.5, -0.13, 0.18))
    world.reset(holding(tower(), "T", tuple(joints(place).tolist())))
    move(world, (0.0, 0.16, 0.0), 8)
    for _ in range(10):
        state = world.step(STAY)
    assert block(state, "D")[2] < 0.15
    assert block(state)[13] == 1.0


def test_what_lies_on_a_held_body_rides_along():
    """A plank is lifted by its middle, with a block on its end."""
    plank = Box("plank", (0.15, 0.03, 0.01), mass_kg=0.3)
    state = State.build(
        {
            ROBOT("robot"): robot_features(joints(hand_at((0.5, 0.0, 0.085))).tolist()),
            BLOCK("plank"): body_features((0.5, 0.0, 0.085)),
            BLOCK("T"): body_features((0.4, 0.0, 0.12)),
        }
    )
    with PandaWorld(Scene((TABLE, plank, cube("T"))), state) as world:
        world.step(CLOSE)
        raised = move(world, (0.0, 0.0, 0.1), 20)
        assert raised.get(BLOCK("plank"), "z") == pytest.approx(0.185, abs=1e-3)
        assert block(raised)[2] == pytest.approx(0.22, abs=5e-3)
        world.step(OPEN)
        for _ in range(12):
            state = world.step(STAY)
        assert state.get(BLOCK("plank"), "z") < 0.1
        assert block(state)[2] < 0.13


def test_a_body_wider_than_the_fingers_open_can_be_let_go_and_left():
    plank = Box("plank", (0.03, 0.07, 0.02), mass_kg=0.3)
    state = State.build(
        {
            ROBOT("robot"): robot_features(joints(hand_at((0.5, 0.0, 0.095))).tolist()),
            BLOCK("plank"): body_features((0.5, 0.0, 0.095)),
        }
    )
    with PandaWorld(Scene((TABLE, plank)), state) as world:
        for action in (CLOSE, OPEN, STAY, STAY):
            after = world.step(action)
            assert np.linalg.norm(after[BLOCK("plank")][7:10]) < 2.0
        q = joints(after).copy()
        after = move(world, (0.0, 0.0, 0.15), 15)
        assert grasp_pose(joints(after)).position[2] > grasp_pose(q).position[2] + 0.13


def test_the_gripper_does_not_open_into_a_wall():
    place = np.array([0.5, 0.057, 0.4])  # a closed finger is clear of the wall, an open one not
    body = Box("T", (0.01, 0.01, 0.01), mass_kg=0.1)
    q = reach(place, 0.0, np.array(HOME))
    grasp = hand_pose(q).inverse().compose(Pose(grasp_pose(q).position))
    state = State.build(
        {
            ROBOT("robot"): robot_features(q.tolist(), 0.01, grasp),
            BLOCK("T"): body_features(grasp_pose(q).position, held=True),
        }
    )
    with PandaWorld(Scene((body,)), state) as world:
        assert block(world.step(OPEN))[13] == 0.0
    wall = Box("wall", (0.2, 0.02, 0.05), pose=Pose((0.5, 0.0, 0.38)))
    with PandaWorld(Scene((body, wall)), state) as world:
        assert block(world.step(OPEN))[13] == 1.0


# -- scenes that cannot be ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (lambda: changed(tower(), "T", z=0.06), "T is inside a fixed body"),
        (lambda: changed(tower(), "T", x=0.51, y=0.01, z=0.14), "T and C|C and T|B and T|T and B"),
        (lambda: changed(tower(), "T", x=np.nan), "features of T are not finite"),
        (lambda: changed(tower(), "T", vx=np.inf), "features of T are not finite"),
        (lambda: changed(tower(), "T", qw=0.9), "the quaternion of T has length 0.9, not 1"),
        (lambda: changed(tower(), "robot", joint4=0.5), "joint 4 = 0.5 rad is not within"),
        (lambda: changed(tower(), "robot", finger=0.1), "finger = 0.1 m is not within"),
        (lambda: changed(tower(), "T", held=1.0), "T is held, but not where the hand has it"),
        (lambda: holding(holding(tower(), "T"), "B"), "holds one body at most, here 2"),
        (lambda: changed(tower(), "robot", joint2=1.4), "the arm, or what it holds, is inside"),
    ],
)
def test_impossible_scenes_are_refused_and_change_nothing(world, state, words):
    with pytest.raises(InvalidStateError, match=words):
        PandaWorld(SCENE, state())
    before = world.state
    with pytest.raises(InvalidStateError, match=words):
        world.reset(state())
    assert world.state is before
    assert world.step(STAY) == before


def test_bodies_that_the_state_does_not_have():
    state = State.build({ROBOT("robot"): robot_features(HOME)})
    with pytest.raises(InvalidStateError, match="'T' is not an object with the features x, y"):
        PandaWorld(SCENE, state)
    bare = State.build({Type("thing")("thing"): {}})
    with pytest.raises(InvalidStateError, match="a scene has one robot, the state has 0"):
        PandaWorld(Scene((TABLE,)), bare)


def test_a_world_keeps_to_its_objects(world):
    other = State.build({ROBOT("robot"): robot_features(HOME)})
    with pytest.raises(InvalidStateError, match="its own objects"):
        world.reset(other)


def test_scenes_that_contradict_themselves():
    with pytest.raises(InvalidDomainError, match="two bodies named a"):
        Scene((cube("a"), cube("a")))
    with pytest.raises(InvalidDomainError, match="must be solid, not so a"):
        Scene((Box("a", (0.1, 0.1, 0.1), mass_kg=1.0, solid=False),))


def test_a_scene_without_free_bodies():
    state = State.build({ROBOT("robot"): robot_features(HOME)})
    with PandaWorld(Scene((TABLE,)), state) as world:
        assert joints(world.step(HIGH))[0] == pytest.approx(HOME[0] + MAX_STEP[0])


# -- simulations shared ------------------------------------------------------------------------


def connected() -> int:
    return sum(bool(pybullet.isConnected(client)) for client in range(64))


def test_ten_worlds_of_a_scene_share_a_client():
    SIMULATIONS.forget()
    before = connected()
    worlds = [PandaWorld(SCENE, tower()) for _ in range(10)]
    assert connected() == before + 1
    states = [world.step(HIGH * (i % 2)) for i, world in enumerate(worlds)]  # all at once
    assert states[2] == states[4] != states[3] == states[5]
    del worlds
    gc.collect()
    assert connected() == before + 1  # kept for the next world of this scene
    SIMULATIONS.forget()
    assert connected() == before


def test_worlds_of_many_scenes_leak_no_clients():
    SIMULATIONS.forget()
    before = connected()
    scenes = [Scene((*SCENE.bodies, small(i))) for i in range(2 * MOST_KEPT)]
    for scene in scenes:
        PandaWorld(scene, tower()).step(STAY)
    gc.collect()
    assert connected() == before + MOST_KEPT
    SIMULATIONS.forget()
    assert connected() == before


def test_worlds_of_several_threads_come_to_the_same_states():
    script = pushes(4, seed=1)
    alone = list(map(pushed, script))
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # s: threads take turns within a step
    try:
        with ThreadPoolExecutor(len(script)) as threads:
            together = list(threads.map(pushed, script))
    finally:
        sys.setswitchinterval(interval)
    assert together == alone


def pushed(push):
    with PandaWorld(SCENE, with_joints(tower(), push.joints)) as world:
        return [world.step(action) for action in push.actions]


def small(i):
    return Box("extra", (0.01, 0.01, 0.01), pose=Pose((-0.5, 0.1 * i, 0.5)))


def test_a_closed_world_cannot_be_stepped():
    world = PandaWorld(SCENE, tower())
    world.close()
    world.close()  # again does no harm
    with pytest.raises(ValueError, match="closed"):
        world.step(STAY)


def test_a_refused_state_takes_no_client():
    SIMULATIONS.forget()
    before = connected()
    with pytest.raises(InvalidStateError):
        PandaWorld(SCENE, changed(tower(), "T", z=0.0))
    assert connected() == before


# -- the arm's clearance ------------------------------------------------------------------------


def test_the_quiet_test_never_overlooks_a_touch():
    """Where a sweep is said to stay clear, a fine look at it finds every link clear."""
    rng = np.random.default_rng(4)
    clear = 0
    for push in pushes(30, seed=21):
        q = push.joints
        for action in push.actions:
            after = q + action[:7]
            arms = Arm.at(q, FINGER_OPEN), Arm.at(after, FINGER_OPEN)
            centre = (np.array([0.5, 0.0, 0.15]) + rng.normal(0, 0.05, 3)).tolist()
            turn = rng.normal(size=4)
            turned = Pose(tuple(centre), tuple((turn / np.linalg.norm(turn)).tolist()))
            box = Box("box", (0.04, 0.025, 0.01)).at(turned)
            if Sweep(*arms).stays_clear(Surroundings([box])):
                clear += 1
                for part in np.linspace(0, 1, 9):
                    arm = Arm.at(q + part * action[:7], FINGER_OPEN)
                    assert not any(arm.box(i).overlaps(box) for i in range(len(arm.links)))
            q = after
    assert clear > 100


def test_the_action_space_is_the_speed_limit():
    assert ACTION_SPACE.high[:7] == MAX_STEP
    assert ACTION_SPACE.low[:7] == tuple(-step for step in MAX_STEP)
    assert [axis.unit for axis in ACTION_SPACE.axes] == ["rad"] * 7 + ["1"]
    assert len(NAMES) == len(SCENE.free)


def test_an_obstacle_knows_how_high_it_is():
    tilted = Box("b", (0.1, 0.1, 0.1)).at(
        Pose((0, 0, 1), (np.sin(np.pi / 8), 0, 0, np.cos(np.pi / 8)))
    )
    assert Obstacle.of(tilted).top == pytest.approx(1 + 0.1 * np.sqrt(2))
