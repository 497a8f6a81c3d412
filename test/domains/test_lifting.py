# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A measured state in which a held block touches something: plans begin with it lifted clear."""

import numpy as np
import pytest

from slap_ros.domains.tabletop.grasps import grasps_along_faces
from slap_ros.domains.tabletop.state_access import JOINT_NAMES, joints_of, robot_of
from slap_ros.motion.inverse_kinematics import inverse_kinematics
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.features import pose_of

pytest.importorskip("pybullet")

DOMAIN = open_domain(DomainChoice("obstacle_tower", "fair"))
MEASURED = open_domain(DomainChoice("obstacle_tower", "fair", measured=True))
INITIAL = DOMAIN.task(1).initial_state
SPACE = DOMAIN.atom_space(INITIAL)
MILLIMETRE = 1e-3


@pytest.fixture(scope="module")
def grasped():
    """The hand has closed around a block that still stands on the table."""
    block = INITIAL.layout.by_name["block1"]
    joints = inverse_kinematics(grasps_along_faces(pose_of(INITIAL, block))[0], joints_of(INITIAL))
    there = zip(JOINT_NAMES, map(float, joints), strict=True)
    world = DOMAIN.make_world(INITIAL.replace({(robot_of(INITIAL), n): q for n, q in there}))
    close = np.zeros(len(DOMAIN.action_space.axes))
    close[-1] = 1.0
    return world.step(close)


def atoms(state):
    return {str(atom) for atom in SPACE.decode(SPACE.abstract(state))}


def test_a_held_block_that_touches_the_table_is_planned_for_as_lifted(grasped):
    on_table = {"On(block1, table)"}
    assert on_table <= atoms(grasped)
    lifted = MEASURED.to_plan_from(grasped)
    assert atoms(lifted) == atoms(grasped) - on_table
    block = grasped.layout.by_name["block1"]
    *_, height = pose_of(lifted, block).position
    *_, before = pose_of(grasped, block).position
    assert 5 * MILLIMETRE < height - before < 7 * MILLIMETRE
    assert np.abs(joints_of(lifted) - joints_of(grasped)).max() < 0.05
    DOMAIN.make_world(grasped).reset(lifted)  # it can be
    assert MEASURED.to_plan_from(lifted) is lifted


def test_what_is_not_held_or_not_measured_stays_as_it_is(grasped):
    assert DOMAIN.to_plan_from(grasped) is grasped
    assert MEASURED.to_plan_from(INITIAL) is INITIAL
