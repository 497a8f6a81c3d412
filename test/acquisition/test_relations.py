# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What skills observe of two objects, and how surely their effects are to hold."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.geometry.pose import Pose, from_yaw, multiply
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.skills.groundings import Grounding, Groundings
from slap_ros.skills.observations import (
    PAIRS,
    RELATION_FEATURES,
    RELATIONS,
    SIZE,
    SkillObserver,
)
from slap_ros.skills.reward import OperatorEffects

HAMMERS = get_domain("stow_hammer")
OPERATORS = {operator.name: operator for operator in HAMMERS.acquisition.operators}
START = HAMMERS.task(0, 0).initial_state
OBJECTS = START.layout.by_name
HAMMER, CABINET = OBJECTS["hammer0"], OBJECTS["cabinet0"]


def only(state, objects):
    (part,) = Groundings([Grounding(state.layout, objects)]).split(
        state.data[None], np.zeros(1, int)
    )
    return part


def relation(state):
    """What is observed of a hammer and a cabinet."""
    observed = SkillObserver(HAMMERS)(only(state, (HAMMER, CABINET)))[0]
    assert observed.shape == (SIZE,)
    first = PAIRS.index((0, 1))
    return observed[RELATIONS + first * RELATION_FEATURES :][:RELATION_FEATURES]


def pose_of(state, obj):
    return Pose(
        tuple(state.get(obj, axis) for axis in "xyz"),
        tuple(state.get(obj, f"q{axis}") for axis in "xyzw"),
    )


def with_pose(state, obj, position, turn):
    values = dict(zip(("x", "y", "z"), position, strict=True))
    values |= dict(zip(("qx", "qy", "qz", "qw"), turn, strict=True))
    return state.replace({(obj, name): value for name, value in values.items()})


def moved_together(state, shift, yaw):
    """The state with hammer and cabinet turned around the origin, and shifted."""
    frame = Pose(shift, from_yaw(yaw))
    for obj in (HAMMER, CABINET):
        pose = pose_of(state, obj)
        state = with_pose(
            state, obj, frame.apply(pose.position), multiply(frame.quaternion, pose.quaternion)
        )
    return state


def test_a_relation_is_the_same_wherever_both_objects_are():
    here = relation(START)
    assert np.abs(here).max() > 0.5
    for shift in ((0.2, -0.1, 0.0), (0.0, 0.0, 0.1)):
        assert relation(moved_together(START, shift, 0.0)) == pytest.approx(here, abs=1e-5)
    for yaw in (1.3, -2.9):
        turned = relation(moved_together(START, (-0.3, 0.2, 0.0), yaw))
        assert turned[0] == pytest.approx(here[0], abs=1e-5)  # the distance
        assert turned[4:] == pytest.approx(here[4:], abs=1e-5)  # how one is turned to the other


def test_a_relation_tells_millimetres_and_the_side():
    by = [
        relation(START.replace({(HAMMER, "x"): START.get(HAMMER, "x") + shift}))
        for shift in (-0.002, 0.0, 0.002)
    ]
    assert np.abs(by[0] - by[1]).max() > 0.005
    assert np.sign(by[0] - by[1])[1:4] == pytest.approx(-np.sign(by[2] - by[1])[1:4])


def test_products_of_an_axis_are_the_same_either_way_round():
    pose = pose_of(START, HAMMER)
    round_about = multiply(from_yaw(math.pi), pose.quaternion)
    other = relation(with_pose(START, HAMMER, pose.position, round_about))
    here = relation(START)
    assert other[:4] == pytest.approx(here[:4], abs=1e-5)
    assert other[4:7] == pytest.approx(-here[4:7], abs=1e-5)
    assert other[7:] == pytest.approx(here[7:], abs=1e-5)


def test_an_open_drawer_is_related_to_what_goes_into_it():
    closed, opened = (relation(START.replace({(CABINET, "opening"): o})) for o in (0.0, 0.12))
    assert np.abs(opened[1:4] - closed[1:4]).max() > 0.05
    assert opened[4:] == pytest.approx(closed[4:])


@pytest.mark.parametrize(
    ("operator", "opening", "sure"),
    [("Open", 0.105, False), ("Open", 0.14, True), ("Close", 0.008, False), ("Close", 0.002, True)],
)
def test_a_drawer_is_moved_further_than_its_predicate_asks_for(operator, opening, sure):
    state = START.replace({(CABINET, "opening"): opening})
    part = only(state, (CABINET,))
    interface = replace(learner_interface(HAMMERS), success_tolerance=lambda _: 0.0)
    exactly = OperatorEffects(OPERATORS[operator], interface)
    surely = OperatorEffects(OPERATORS[operator], learner_interface(HAMMERS))
    assert exactly.hold(part).tolist() == [True]
    assert surely.hold(part).tolist() == [sure]
