# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Given skills on an arm that is not where it was sent."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.skills import TrajectoryFollower
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.panda import HOME, MAX_STEP

DOMAIN = get_domain("obstacle_tower", "fair")
START = DOMAIN.task(0).initial_state
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
