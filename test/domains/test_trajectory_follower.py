# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Given skills on an arm that is not where it was sent."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.skills import AIM, AIM_STEPS, Aim, TrajectoryFollower
from slap_ros.motion import shifted
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.panda import HOME, MAX_STEP, grasp_pose

DOMAIN = get_domain("obstacle_tower", "fair")
START = DOMAIN.task(0).initial_state
(BLOCK,) = (obj for obj in START.objects if obj.name == "block1")
(ROBOT,) = (obj for obj in START.objects if obj.type.name == "robot")
WAY = [np.array(HOME) + k * np.array(MAX_STEP) for k in range(1, 6)]
SCRIPT = [*((position, 0.0) for position in WAY), (WAY[-1], 1.0)]


def at(joints):
    return START.replace(
        {(ROBOT, f.name): float(q) for f, q in zip(JOINT_FEATURES, joints, strict=True)}
    )


def run(follow, arrives):
    """Commands until there are none, on an arm that goes a part of each of its ways."""
    joints, actions = np.array(HOME), []
    while (action := follow(at(joints))) is not None:
        DOMAIN.action_space.check(action)
        actions.append(action)
        joints = joints + arrives * action[:7]
    return joints, actions


def test_an_arm_that_arrives_is_sent_along_the_script():
    joints, actions = run(TrajectoryFollower(SCRIPT, MAX_STEP), 1.0)
    assert len(actions) == len(SCRIPT)
    assert np.allclose(joints, WAY[-1])


def test_an_arm_that_lags_is_never_asked_for_more_than_it_may_do_and_still_arrives():
    joints, actions = run(TrajectoryFollower(SCRIPT, MAX_STEP), 0.8)
    assert len(actions) > len(SCRIPT)
    assert np.abs(joints - WAY[-1]).max() < 0.02
    assert [action[7] for action in actions].count(1.0) == 1
    assert actions[-1][7] == 1.0


def test_an_arm_that_is_held_up_does_not_keep_a_skill_for_ever():
    _, actions = run(TrajectoryFollower(SCRIPT, MAX_STEP), 0.0)
    assert len(SCRIPT) < len(actions) <= 3 * len(SCRIPT)


# Where a block is that the fingers are around at the end of the way.
GRASPED = grasp_pose(WAY[-1]).position


def beside(joints, block):
    """The arm at joint positions, and the block with its middle somewhere."""
    moved = {(BLOCK, axis): part for axis, part in zip("xyz", block, strict=True)}
    return at(joints).replace(moved)


def gripping(shake, block):
    """Joint positions and block at each command to grip, where the arm shakes; commands in all."""
    rng, joints, gripped = np.random.default_rng(0), np.array(HOME), []
    aim = Aim.at(BLOCK, beside(HOME, GRASPED))
    follow, count = TrajectoryFollower(SCRIPT, MAX_STEP, aim), 0
    while (action := follow(beside(joints, block))) is not None:
        DOMAIN.action_space.check(action)
        if action[7] == 1.0:
            gripped.append(joints)
        joints, count = joints + action[:7] + shake * rng.standard_normal(7), count + 1
    return gripped, count


def distance(joints, block):
    return np.linalg.norm(np.subtract(grasp_pose(joints).position, block))


def test_fingers_on_an_arm_that_shakes_close_once_they_are_around_the_block():
    ((joints,), count) = gripping(0.02, GRASPED)
    assert distance(joints, GRASPED) <= AIM
    assert count > len(SCRIPT)


def test_fingers_close_around_a_block_that_was_pushed():
    pushed = (GRASPED[0] + 0.02, GRASPED[1] - 0.01, GRASPED[2])
    ((joints,), _) = gripping(0.0, pushed)
    assert distance(joints, pushed) <= AIM < distance(WAY[-1], pushed)


def test_fingers_close_at_once_where_they_are_around_the_block():
    assert gripping(0.0, GRASPED)[1] == len(SCRIPT)


FAR = shifted(grasp_pose(WAY[-1]), (0.0, 0.0, -2.0)).position  # where no arm gets


def test_an_arm_that_stands_beside_its_block_closes_its_fingers_soon():
    gripped, count = gripping(0.0, FAR)
    assert (len(gripped), count) == (1, len(SCRIPT) + 1)


def test_an_arm_that_shakes_beside_its_block_closes_its_fingers_in_the_end():
    gripped, count = gripping(0.02, FAR)
    assert len(gripped) == 1
    assert len(SCRIPT) + AIM_STEPS <= count <= 2 * len(SCRIPT) + AIM_STEPS
