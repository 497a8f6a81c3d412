# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans from a measured hand that is where the planner's hand cannot be begin beside."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains.benchtop.state_access import POSITION, TARGET, hand_pose, hand_target
from slap_ros.domains.make_coffee.scenery import scene_of
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.planning.planner import make_planner
from slap_ros.relational import State
from slap_ros.skills.domain_choice import DEMONSTRATOR, NO_SKILLS, DomainChoice, open_domain
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.clearing import CLEAR, DEEPEST, FROM_END
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import PAD, hand_at
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.contact.validation import OVERLAP
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.panda import JOINT_HIGH, grasp_pose

BENCHES = ("bowls", "groceries", "make_coffee", "peg_in_hole", "stack_at_target", "stow_hammer")
# Measured in MuJoCo: the pod is inserted, and the hand leans on the open lid.
LEANING = Path(__file__).parent / "data" / "leaning_on_lid.json"
JOINTS = [feature.name for feature in JOINT_FEATURES]
FREE_SPOT = {"bowls": (0.6, 0.3)}  # m, of a table's top, where all others have (0.45, 0)
TIPS = PAD.pose.position[2] + PAD.half_extents_m[2]  # m, below the grasp point


@pytest.fixture(scope="module")
def coffee():
    """Make Coffee with the demonstrator's scripts, whose states are measured."""
    return open_domain(DomainChoice("make_coffee", "fair:hand=panda", DEMONSTRATOR, measured=True))


@pytest.fixture(scope="module")
def leaning(coffee):
    """The measured state of a hand that leans on a lid."""
    objects = json.loads(LEANING.read_text())["objects"]
    types = coffee.types_by_name
    kinds = {"robot": ROBOT.name}
    return State.build(
        {types[kinds.get(name, name)](name): features for name, features in objects.items()}
    )


def with_hand(state, hand):
    (robot,) = state.layout.of_type(ROBOT)
    return state.replace({(robot, name): value for name, value in robot_features(hand).items()})


def shifted(state, way):
    """The state with the hand, its target and the arm elsewhere, m."""
    (robot,) = state.layout.of_type(ROBOT)
    (position, turn), (target, _) = hand_pose(state), hand_target(state)
    there = tuple((np.array(position) + way).tolist())
    values = dict(zip(POSITION, there, strict=True))
    values |= zip(TARGET, (np.array(target) + way).tolist(), strict=True)
    values |= zip(JOINTS, arm_joints(Pose(there, turn)), strict=True)
    return state.replace({(robot, name): value for name, value in values.items()})


def changed(before, after):
    """Objects of which something has changed."""
    parts = {obj.name: obj.type.features for obj in before.objects}
    return {
        name
        for name, features in parts.items()
        if any(
            before.get(before.layout.object(name), f.name)
            != after.get(after.layout.object(name), f.name)
            for f in features
        )
    }


def require_refused(domain, state, why):
    with pytest.raises(InvalidStateError, match=why):
        domain.make_world(state).close()


def test_a_plan_begins_where_a_hand_that_leans_on_a_lid_is_free(coffee, leaning):
    require_refused(coffee, leaning, "the hand and holder are inside one another")
    start = coffee.to_plan_from(leaning)
    assert changed(leaning, start) == {"robot"}
    there, here = hand_pose(start), hand_pose(leaning)
    way = np.subtract(there.position, here.position)
    assert OVERLAP < np.linalg.norm(way) < DEEPEST
    assert there.quaternion == here.quaternion
    assert np.allclose(np.subtract(hand_target(start)[0], hand_target(leaning)[0]), way)
    coffee.make_world(start).close()
    space = coffee.atom_space(leaning)
    assert space.abstract(start) == space.abstract(leaning)
    assert coffee.to_plan_from(start) is start
    goal = space.mask(coffee.default_goal(leaning))
    planner = make_planner("lazy", coffee, coffee.task(304).initial_state)
    edges = planner.plan(start, goal).plan.edges
    assert {edge.option.skill.name for edge in edges} == {"Close", "CloseLid"}


def test_a_hand_that_is_too_deep_stays_there_and_is_refused(coffee, leaning):
    """Further on in the same direction, no difference of shapes explains it."""
    free = coffee.to_plan_from(leaning)
    inwards = np.subtract(hand_pose(leaning).position, hand_pose(free).position)
    inwards /= np.linalg.norm(inwards)
    near = shifted(free, 0.9 * DEEPEST * inwards)
    assert coffee.to_plan_from(near) is not near
    deep = shifted(free, 1.1 * DEEPEST * inwards)
    assert coffee.to_plan_from(deep) is deep
    require_refused(coffee, deep, "inside one another")


@pytest.mark.parametrize("name", BENCHES)
def test_fingers_in_a_table_are_raised_at_every_bench(name):
    """And no other state is changed, by a bit: pressed ones neither, nor those not measured."""
    measured = open_domain(DomainChoice(name, skills=NO_SKILLS, measured=True))
    state = measured.task(0).initial_state
    assert measured.to_plan_from(state) is state
    for depth in (0.9 * OVERLAP, 1.2 * OVERLAP, 1.1 * DEEPEST):
        low = with_hand(state, hand_at((*FREE_SPOT.get(name, (0.45, 0.0)), TIPS - depth)))
        start = measured.to_plan_from(low)
        if OVERLAP < depth < DEEPEST:
            assert math.isclose(hand_pose(start).position[2], TIPS + CLEAR, abs_tol=1e-9)
            measured.make_world(start).close()
        else:
            assert start is low
        assert open_domain(DomainChoice(name, skills=NO_SKILLS)).to_plan_from(low) is low


def test_an_arm_at_the_end_of_a_joint_is_put_back_into_its_plane(coffee):
    """An elbow may be out of the plane in which the planner has it, and joint 7 at its end."""
    state = coffee.task(0).initial_state
    (robot,) = state.layout.of_type(ROBOT)
    index = ContactIndex.of(scene_of(state), state.layout)
    for aside in (-0.004, -0.3):  # rad, of joint 3
        joints = (0.0, 0.4, aside, -2.3, 0.0, 2.7, JOINT_HIGH[6])
        pose = grasp_pose(joints)
        x, y, _, _ = pose.quaternion
        hand = hand_at(pose.position, 2.0 * math.atan2(y, x))._replace(pose=pose)
        measured = index.write(state, index.read(state)._replace(joints=joints, hand=hand))
        require_refused(coffee, measured, "the arm cannot have its hand at")
        start = coffee.to_plan_from(measured)
        if aside > -0.1:
            coffee.make_world(start).close()
            assert math.dist(hand_pose(start).position, pose.position) < 0.005
            there = [float(start.get(robot, name)) for name in JOINTS]
            assert there == pytest.approx((*joints[:2], 0.0, *joints[3:]), abs=2.0 * FROM_END)
        else:
            assert start is measured


def test_what_is_held_goes_along(coffee):
    state = coffee.task(0).initial_state
    (robot,) = state.layout.of_type(ROBOT)
    pod = state.layout.object("pod")
    at = (0.45, 0.0, TIPS - 1.2 * OVERLAP)
    held = with_hand(state, hand_at(at, finger=0.025, closing=True)).replace(
        {(pod, axis): value for axis, value in zip(POSITION, at, strict=True)}
        | {(pod, "held"): 1.0}
    )
    start = coffee.to_plan_from(held)
    assert changed(held, start) == {"robot", "pod"}
    assert start.get(pod, "z") - held.get(pod, "z") == pytest.approx(1.2 * OVERLAP + CLEAR)
    assert start.get(robot, "z") - held.get(robot, "z") == pytest.approx(1.2 * OVERLAP + CLEAR)
    joints = [float(start.get(robot, name)) for name in JOINTS]
    assert tuple(joints) == arm_joints(hand_pose(start))
