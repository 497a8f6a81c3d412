# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the hand leaves where it is."""

import pytest

from benchmarks.physics_step import with_joints
from benchmarks.travel import GOALS, measure
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower.skills import PLANNING_SCENE
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.skills import APPROACH_STEPS, TRAVEL_STEPS
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.domains.tabletop.transit import CLEARANCE, LOWER, Transit
from slap_ros.motion import nearest_configurations
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.joint_space.scene import CUBE_EDGE
from slap_ros.worlds.panda import grasp_pose

DOMAIN = get_domain("obstacle_tower", "paper")
FINGERS = 0.042  # m, from the hand's middle to where an open finger ends
BLOCKS = ("block1", "block2", "block3", "block4")
BODY = ("x", "y", "z", "qx", "qy", "qz", "qw", "held")
GRASP = ("finger", *(f"grasp_{part}" for part in ("x", "y", "z", "qx", "qy", "qz", "qw")))
ELSEWHERE = from_above((0.45, -0.3, 0.3), 0.0)


def beside_the_tower(gap, blocks_up):
    """The hand beside the tower, so many blocks over its foot; the gap to a finger, m."""
    state = DOMAIN.task(0).initial_state
    x, y, z = pose_of(state, state.layout.object("block2")).position
    aside = y - CUBE_EDGE / 2 - FINGERS - gap
    pose = from_above((x, aside, z + blocks_up * CUBE_EDGE), 0.0)
    (joints,) = nearest_configurations([pose], joints_of(state))
    return with_joints(state, joints)


def rise(state):
    """How far it goes up before it goes elsewhere, m."""
    (candidate,) = Transit(PLANNING_SCENE, state, [ELSEWHERE], ()).candidates
    before, after = grasp_pose(joints_of(state)), grasp_pose(candidate.retreat[-1])
    return after.position[2] - before.position[2]


@pytest.mark.parametrize(
    ("gap", "blocks_up", "expected"),
    [
        (0.05, 4, 0.0),  # nothing is near
        (0.002, 2, CLEARANCE),  # over the tower's top after that
        (0.002, 1, 2 * CLEARANCE),  # with a finger still beside its top block after the first
        (0.002, 0, 3 * CLEARANCE),
    ],
)
def test_the_hand_rises_until_it_can_go_across(gap, blocks_up, expected):
    assert rise(beside_the_tower(gap, blocks_up)) == pytest.approx(expected, abs=1e-4)


def test_the_hand_rises_less_where_something_is_in_the_way_further_up():
    """As a slap has left it: tilted, with a block that would run into the top of the tower."""
    state = get_domain("obstacle_tower", "fair").task(303).initial_state
    robot, held, *tower = (state.layout.object(n) for n in ("robot", *BLOCKS))
    places = [(0.488, -0.083, 0.1), (0.488, -0.087, 0.15), (0.487, -0.079, 0.2)]
    turns = [(0.0, 0.0, 0.109, 0.994), (0.0, 0.0, 0.162, 0.987), (0.0, 0.0, 0.179, 0.984)]
    moved = [
        named(block, BODY, (*place, *turn, 0.0))
        for block, place, turn in zip(tower, places, turns, strict=True)
    ]
    moved.append(named(held, BODY, (0.468, -0.017, 0.133, -0.153, 0.171, 0.378, 0.897, 1.0)))
    moved.append(named(robot, GRASP, (0.025, 0.001, 0.0, 0.102, -0.698, -0.712, 0.047, 0.06)))
    state = state.replace({key: value for one in moved for key, value in one.items()})
    joints = (-0.706, 0.282, 0.808, -2.366, -0.911, 2.185, -0.857)
    assert rise(with_joints(state, joints)) == pytest.approx(LOWER, abs=1e-4)


def named(obj, names, values):
    return {(obj, name): value for name, value in zip(names, values, strict=True)}


def test_an_arm_takes_more_steps_to_another_place_than_proofs_count_on():
    """The fastest of all configurations and starts; whole steps make three of more than two."""
    least = measure(24, GOALS[::7])
    assert least["approach"] > APPROACH_STEPS - 1
    assert least["travel"] > TRAVEL_STEPS - 1
