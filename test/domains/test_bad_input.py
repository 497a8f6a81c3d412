# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What domains with contact refuse: a named error with the value, and a world that goes on."""

import math
from functools import cache

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.registry import OURS
from slap_ros.errors import (
    InvalidCommandError,
    InvalidParameterError,
    InvalidStateError,
    UnknownGoalError,
)
from slap_ros.relational import State
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES

DOMAINS = [name for name in OURS if get_domain(name).acquisition is not None]
GARBAGE = 60  # states for each domain
STAY = np.zeros(5)


@cache
def initial(name):
    return get_domain(name).task(0).initial_state


@pytest.fixture(scope="module", params=DOMAINS)
def domain(request):
    return get_domain(request.param)


@pytest.fixture(scope="module")
def world(domain):
    with domain.make_world(initial(domain.name)) as world:
        yield world


@pytest.fixture
def usable(domain, world):
    """After whatever was refused, the world goes on as one does that never saw it."""
    begin = initial(domain.name)
    world.reset(begin)
    yield world
    assert world.state is begin
    refused = world.step(STAY)
    world.reset(begin)
    assert world.step(STAY) == refused


def objects_with(state, features):
    return [obj for obj in state.objects if set(features) <= set(obj.type.features)]


def refused(world, changes, message):
    with pytest.raises(InvalidStateError, match=message):
        world.reset(world.state.replace(changes))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([0.0] * 4, "5 entries"),
        ([0.0] * 6, "5 entries"),
        ([], "5 entries"),
        ([0.0, math.nan, 0.0, 0.0, 0.0], "command y = nan"),
        ([0.0, 0.0, -0.5, 0.0, 0.0], r"command z = -0\.5"),
        ([0.0, 0.0, 0.0, 3.0, 0.0], r"command yaw = 3\.0"),
        ([0.0, 0.0, 0.0, 0.0, -2.0], r"command gripper = -2\.0"),
    ],
)
def test_commands(usable, action, message):
    with pytest.raises(InvalidCommandError, match=message):
        usable.step(np.array(action))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_feature_may_be_other_than_finite(usable, value):
    for obj in usable.state.objects:
        for feature in obj.type.features:
            refused(usable, {(obj, feature.name): value}, f"features of {obj.name} are not finite")


def test_quaternions_of_length_2(usable):
    for obj in objects_with(usable.state, POSE_FEATURES):
        twice = {
            (obj, feature): 2.0 * float(usable.state.get(obj, feature))
            for feature in ("qx", "qy", "qz", "qw")
        }
        refused(
            usable, twice, rf"the quaternion of (the hand|{obj.name}) has length 2\.0\d*, not 1"
        )


def test_drawers_and_lids_beyond_their_range(usable):
    for obj in usable.state.objects:
        if "opening" in obj.type.column:
            refused(usable, {(obj, "opening"): 5.0}, rf"the opening of {obj.name} is 5\.0, not")
            refused(usable, {(obj, "opening"): -0.1}, rf"the opening of {obj.name} is -0\.1, not")


def test_bodies_inside_one_another(usable):
    state = usable.state
    bodies = objects_with(state, BODY_FEATURES)
    for body, other in zip(bodies, (*bodies[1:], bodies[0]), strict=True):
        refused(usable, {(body, "z"): -0.05}, f"{body.name} and table are inside one another")
        if other is not body:
            pose = [feature.name for feature in POSE_FEATURES]
            there = {(body, name): float(state.get(other, name)) for name in pose}
            refused(usable, there, "are inside one another")
        (robot,) = state.layout.of_type(ROBOT)
        above = {(body, axis): float(state.get(robot, axis)) for axis in ("x", "y")}
        above[body, "z"] = float(state.get(robot, "z")) + 0.08
        refused(usable, above, f"the hand and {body.name} are inside|{body.name} and the hand")


def test_what_is_held_is_between_the_fingers(usable):
    for body in objects_with(usable.state, BODY_FEATURES):
        refused(usable, {(body, "held"): 1.0}, f"{body.name} is held, but not between")


def test_random_garbage(domain, usable):
    """It is refused by a named error, or stepped to a state that is finite."""
    rng = np.random.default_rng(0)
    fine, actions = initial(domain.name), domain.action_space
    accepted = 0
    for _ in range(GARBAGE):
        data = fine.data.copy()
        for i in rng.integers(data.size, size=rng.integers(1, 4)):
            scale = 10.0 ** rng.uniform(-4, 6)
            data[i] = rng.choice([np.nan, rng.normal(0, scale), data[i] + rng.normal(0, 1e-3)])
        try:
            usable.reset(State(fine.layout, data))
        except InvalidStateError as error:
            assert str(error)
        else:
            accepted += 1
            for _ in range(2):
                assert np.isfinite(usable.step(rng.uniform(actions.low, actions.high)).data).all()
    assert 0 < accepted < GARBAGE
    usable.reset(fine)


def test_goals_that_do_not_exist(domain):
    first = next(iter(domain.goals))
    with pytest.raises(UnknownGoalError, match=f"no goal 'test9'; there are {first}"):
        domain.task(0, goal="test9")


@pytest.mark.parametrize("value", ["many", "nan", "inf", "-inf", "1e999", "", "1..2..3", "0x10"])
def test_settings_that_are_no_numbers(domain, value):
    for setting in domain.configuration:
        with pytest.raises(InvalidParameterError, match=f"{setting!r}|not of the form"):
            get_domain(domain.name, f"fair:{setting}={value}")


def test_settings_that_do_not_exist(domain):
    with pytest.raises(InvalidParameterError, match="unknown setting 'colour'; there are"):
        get_domain(domain.name, "fair:colour=3")


def test_what_a_setting_can_be_is_said():
    for name, text, wanted in (
        ("peg_in_hole", "clearance=wide", "'clearance' is 5.0, which 'wide' .*; give a number"),
        ("peg_in_hole", "height=1..0", "'1..0' cannot replace; give low..high"),
        ("stack_at_target", "cubes=2.5", "which '2.5' cannot replace; give a whole number"),
    ):
        with pytest.raises(InvalidParameterError, match=wanted):
            get_domain(name, f"fair:{text}")


@pytest.mark.parametrize("clearance", ["0", "-3", "0.0", "-1e-9", "1e9"])
def test_clearances_that_cannot_be(clearance):
    with pytest.raises(InvalidParameterError) as refusal:
        get_domain("peg_in_hole", f"fair:clearance={clearance}")
    assert f"'clearance' is {float(clearance)}; it must be from 1 to 10" in str(refusal.value)
