# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the hand leaves where it is."""

import pytest

from benchmarks.physics_step import with_joints
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower.skills import PLANNING_SCENE
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.state_access import joints_of, pose_of
from slap_ros.domains.tabletop.transit import CLEARANCE, Transit
from slap_ros.motion import nearest_configurations
from slap_ros.worlds.joint_space.scene import CUBE_EDGE
from slap_ros.worlds.panda import grasp_pose

DOMAIN = get_domain("obstacle_tower", "paper")
FINGERS = 0.042  # m, from the hand's middle to where an open finger ends
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
    ],
)
def test_the_hand_rises_until_it_can_go_across(gap, blocks_up, expected):
    assert rise(beside_the_tower(gap, blocks_up)) == pytest.approx(expected, abs=1e-4)
