# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A hand whose way up is free goes up and moves nothing; one that is caught is known to be."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.cabinet import CABINET
from slap_ros.domains.benchtop.drawers import handle_of
from slap_ros.domains.benchtop.hand_motion import KEEP, HandGoal, action_towards
from slap_ros.domains.benchtop.state_access import hand_position, position_of, value, yaw_of
from slap_ros.domains.make_coffee.scenery import POD, POD_HALF, POD_RADIUS
from slap_ros.domains.stow_hammer.scenery import HAMMER, RADIUS
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import from_yaw
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import PAD, hand_at

HAMMERS = get_domain("stow_hammer")
START = HAMMERS.task(0, 0).initial_state
CAN_LEAVE = learner_interface(HAMMERS).can_leave
UP, STEPS = 0.2, 14  # m; environment steps in which a hand that is free is there
TIPS = PAD.pose.position[2] + PAD.half_extents_m[2]  # m, below the grasp point
FINGERS = 0.012  # m from the middle, each: around a bar, with 5 mm to either side


def with_hand(state, position, yaw, finger):
    """The state with a hand there, at rest, its fingers told to close no further."""
    robot = state.layout.of_type(ROBOT)[0]
    features = robot_features(hand_at(position, yaw, finger))
    return state.replace({(robot, name): number for name, number in features.items()})


def raised(state):
    """What comes of going straight up."""
    world, up = HAMMERS.make_world(state), HandGoal(hand_position(state)).at_height(UP)
    for _ in range(STEPS):
        action = action_towards(world.state, up, KEEP)
        action[3] = 0.0
        world.step(action)
    return world.state


def can_leave(state):
    return bool(CAN_LEAVE(State(state.layout, state.data[None]))[0])


def test_a_hand_that_is_free_moves_nothing_on_its_way_up():
    rng, tried = np.random.default_rng(0), 0
    cabinet = START.layout.of_type(CABINET)[0]
    for _ in range(300):
        state = START.replace({(cabinet, "opening"): float(rng.uniform(0.0, 0.16))})
        at = np.array(handle_of(state, cabinet)) + rng.uniform((-0.1,) * 2 + (-0.02,), 0.1, 3)
        finger = float(rng.uniform(0.0, 0.04))
        try:
            state = with_hand(state, tuple(at.tolist()), yaw_of(state, cabinet), finger)
            if not can_leave(state):
                continue
            after = raised(state)
        except InvalidStateError:
            continue  # inside a body, or out of the arm's reach
        tried += 1
        assert value(after, cabinet, "opening") == pytest.approx(value(state, cabinet, "opening"))
        assert hand_position(after)[2] == pytest.approx(UP, abs=0.003)
        if tried == 30:
            return
    raise AssertionError(f"the way up was free for {tried} hands only")


@pytest.mark.parametrize(("below", "free"), [(0.0, True), (0.022, False)])
def test_a_bar_above_pads_holds_a_hand(below, free):
    """At the height of the bar the pads are beside it; 22 mm below, it is between the stems."""
    cabinet = START.layout.of_type(CABINET)[0]
    x, y, z = handle_of(START, cabinet)
    finger = FINGERS if free else 0.002
    state = with_hand(START, (x, y, z - below), yaw_of(START, cabinet), finger)
    assert can_leave(state) == free
    risen = hand_position(raised(state))[2] - hand_position(state)[2]
    assert (risen > 0.1) == free


def test_what_the_hand_stands_on_does_not_hold_it():
    """Fingertips on a hammer's handle can leave it; inside its height they would take it along."""
    (hammer, *_) = START.layout.of_type(HAMMER)
    x, y, z = position_of(START, hammer)
    for height in (z + RADIUS + TIPS - 0.0001, z + 0.005):
        state = with_hand(START, (x, y, height), 0.0, 0.0)
        assert can_leave(state) == (height > z + RADIUS)


@pytest.mark.parametrize(("gap", "free"), [(0.0, False), (0.003, True)])
def test_a_round_handle_between_the_pads_goes_along_until_they_let_go(gap, free):
    """A box inside the handle would be free of pads that still touch it."""
    (hammer, *_) = START.layout.of_type(HAMMER)
    across = yaw_of(START, hammer)
    state = with_hand(START, position_of(START, hammer), across, RADIUS + gap)
    assert can_leave(state) == free


@pytest.mark.parametrize("yaw", np.linspace(0.0, 0.5 * np.pi, 7))
def test_round_things_are_not_taken_for_square_ones(yaw):
    """Open pads are 40 mm from the middle, where a box around a pod would reach 35 mm."""
    coffee = get_domain("make_coffee")
    start = coffee.task(0, 0).initial_state
    (pod,) = start.layout.of_type(POD)
    for aside in (0.0, 0.01, 0.02):
        hand = (0.45, aside, POD_HALF)
        turn = from_yaw(float(yaw))
        placed = {"x": 0.45, "y": 0.0, "z": POD_HALF, "qz": turn[2], "qw": turn[3]}
        state = start.replace({(pod, name): value for name, value in placed.items()})
        state = with_hand(state, hand, 0.0, 0.04)
        caught = POD_RADIUS + aside > 0.04 - 0.001  # less the margin
        free = learner_interface(coffee).can_leave(State(state.layout, state.data[None]))
        assert bool(free[0]) != caught, aside
