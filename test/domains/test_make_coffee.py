# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pod goes from its drawer into the holder, by the paper's plan; and nothing less does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.cabinet import TRAVEL
from slap_ros.domains.benchtop.hand_motion import OPEN, HandGoal
from slap_ros.domains.benchtop.scripts import Move, follow, over
from slap_ros.domains.benchtop.state_access import hand_position, hand_target, position_of
from slap_ros.domains.make_coffee.scenery import (
    BOTTOM,
    HOLDER_RADIUS,
    LID_HIGH,
    POD_HALF,
    POD_RADIUS,
    SHAPE,
)
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.contact.world import MAX_SHIFT
from slap_ros.worlds.features import pose_of
from support.drawer_states import (
    assert_margins_agree,
    assert_metrics_agree,
    atoms,
    carry_out,
    constant_motions,
    put,
)
from support.states import changed, initial_states_at_rest

DOMAIN = get_domain("make_coffee")
SCRIPTED = open_domain(DomainChoice("make_coffee", skills="demonstrator"))
PLAN = (
    ("Open", ("cabinet",)),
    ("Pick", ("cabinet", "pod")),
    ("Insert", ("pod", "holder")),
    ("CloseLid", ("holder",)),
    ("Close", ("cabinet",)),
)


def inserted(state, aside=0.0, up=0.0):
    """The state with the pod in the holder, or somewhat off."""
    frame = pose_of(state, state.layout.object("holder"))
    return put(state, "pod", frame.compose(Pose((aside, 0.0, BOTTOM + POD_HALF + up))))


def in_drawer(state, aside=0.0, up=0.0):
    """The state with the pod in the drawer."""
    cabinet = state.layout.object("cabinet")
    x, y, z = drawers.middle_of(state, cabinet)
    return put(state, "pod", Pose((x + aside, y, z + POD_HALF + up)))


def scattered(initial, count):
    """A batch in which the pod is about the drawer and about the holder; both more or less open."""
    rng, rows = np.random.default_rng(4), []
    for _ in range(count):
        opening = float(rng.choice([0.0, 0.01, 0.1, rng.uniform(0.0, TRAVEL)]))
        lid = float(rng.choice([0.0, rng.uniform(0.05, 0.12), rng.uniform(0.0, LID_HIGH)]))
        state = changed(changed(initial, "cabinet", opening=opening), "holder", opening=lid)
        where = inserted if rng.random() < 0.5 else in_drawer
        aside = float(rng.normal(0.0, 0.006 if where is inserted else 0.04))
        state = where(state, aside, float(rng.choice([0.0, rng.normal(0.0, 0.02)])))
        rows.append(changed(state, "pod", held=float(rng.random() < 0.3)).data)
    return State(initial.layout, np.stack(rows))


# -- tasks and plans ------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_tasks_differ_and_can_be(preset):
    domain = get_domain("make_coffee", preset)
    names = ("pod", "cabinet", "holder")
    initial_states_at_rest(domain, lambda layout: map(layout.object, names))


@pytest.mark.parametrize(("preset", "seed"), [("fair", 1), ("fair", 2), ("fair:hand=panda", 301)])
def test_the_demonstrator_does_what_the_paper_plans(preset, seed):
    """Also where the hand slips on the pod, so that its fingers come near the rim of the holder."""
    scripted = open_domain(DomainChoice("make_coffee", preset, "demonstrator"))
    shown = demonstrate(scripted, scripted.task(seed))
    assert shown.episode.success
    assert tuple((edge.option, edge.objects) for edge in shown.episode.edges) == PLAN
    found = atoms(DOMAIN, shown.episode.states[-1])
    assert {"In(pod, holder)", "IsLidClose(holder)", "IsCabinetClose(cabinet)"} <= found


def test_the_lid_is_not_closed_before_the_pod_is_in():
    """Nothing opens it again, so no plan is left."""
    state = changed(SCRIPTED.task(3).initial_state, "holder", opening=0.0)
    shown = demonstrate(SCRIPTED, replace(SCRIPTED.task(3), initial_state=state))
    assert not shown.episode.success
    assert not shown.episode.edges


# -- predicates -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("off", "holds"),
    [
        ({}, True),
        ({"aside": 0.0055}, True),
        ({"aside": 0.0065}, False),
        ({"up": 0.0045}, True),
        ({"up": 0.0055}, False),
    ],
)
def test_how_a_pod_must_stand_in_the_holder(off, holds):
    found = atoms(DOMAIN, inserted(DOMAIN.task(3).initial_state, **off))
    assert ("In(pod, holder)" in found) == holds
    assert ("IsEmpty(holder)" in found) != holds


def test_a_pod_is_in_its_drawer_until_it_is_lifted_out():
    state = changed(DOMAIN.task(4).initial_state, "cabinet", opening=TRAVEL)
    resting, grasped, lifted = (
        atoms(DOMAIN, changed(in_drawer(state, up=up), "pod", held=held))
        for up, held in ((0.0, 0.0), (0.015, 1.0), (0.025, 1.0))
    )
    assert {"InCabinet(pod, cabinet)", "HandEmpty()"} <= resting
    assert {"InCabinet(pod, cabinet)", "Holding(pod)"} <= grasped
    assert "InCabinet(pod, cabinet)" not in lifted
    assert "HandEmpty()" not in grasped


@pytest.mark.parametrize(("degrees", "stands"), [(14, True), (16, False), (90, False)])
def test_a_pod_that_leans_is_neither_in_its_drawer_nor_held(degrees, stands):
    """It would not go into the holder."""
    half = 0.5 * math.radians(degrees)
    state = changed(in_drawer(DOMAIN.task(4).initial_state), "pod", held=1.0)
    upright = pose_of(state, state.layout.object("pod"))
    leaning = Pose(upright.position, (math.sin(half), 0.0, 0.0, math.cos(half)))
    found = atoms(DOMAIN, put(state, "pod", leaning))
    assert ("InCabinet(pod, cabinet)" in found) == ("Holding(pod)" in found) == stands


@pytest.mark.parametrize(
    ("degrees", "names"), [(4, {"IsLidClose"}), (6, set()), (59, set()), (61, {"IsLidOpen"})]
)
def test_a_lid_is_open_closed_or_neither(degrees, names):
    state = changed(DOMAIN.task(5).initial_state, "holder", opening=math.radians(degrees))
    assert {name[:-8] for name in atoms(DOMAIN, state) if "Lid" in name} == names


def test_truth_and_margin_agree():
    assert_margins_agree(DOMAIN, scattered(DOMAIN.task(6).initial_state, 2_000))


def test_metrics_are_defined_alike_for_one_and_for_many():
    assert_metrics_agree(DOMAIN, scattered(DOMAIN.task(7).initial_state, 20))


# -- skills ---------------------------------------------------------------------------------------


def test_constant_motions_do_not_make_coffee():
    """A pod that is let fall hardly ever falls into the holder."""
    done = constant_motions(DOMAIN, DOMAIN.task(8).initial_state, PLAN)
    assert len(done) == 20
    assert not any(done.values()), done


def test_a_lid_stays_where_it_is_left():
    state = DOMAIN.task(11).initial_state
    with DOMAIN.make_world(state) as world:
        for opening in (0.3, 0.8, 1.5, 2.0):
            world.reset(changed(state, "holder", opening=opening))
            for _ in range(20):
                world.step(np.zeros(5))
            left = float(world.state.get(state.layout.object("holder"), "opening"))
            assert left == pytest.approx(opening, abs=0.01)


def test_a_pod_fits_with_some_room():
    assert pytest.approx(0.004) == HOLDER_RADIUS - POD_RADIUS
    assert SHAPE.headroom > 2.0 * POD_HALF


def test_an_approach_does_not_depend_on_the_order_of_objects():
    """Operators that were proposed have their objects in an order of their own."""
    state = in_drawer(changed(DOMAIN.task(14).initial_state, "cabinet", opening=TRAVEL))
    pod, cabinet = map(state.layout.object, ("pod", "cabinet"))
    for objects in ((pod, cabinet), (cabinet, pod)):
        with DOMAIN.make_world(state) as world:
            after = carry_out(world, DOMAIN.acquisition.approach(state, objects))
            hand = math.dist(hand_position(after), position_of(after, pod))
            assert 0.04 < hand < 0.05


def test_an_approach_ends_behind_the_lid():
    state = DOMAIN.task(12).initial_state
    holder = state.layout.object("holder")
    with DOMAIN.make_world(state) as world:
        after = carry_out(world, DOMAIN.acquisition.approach(state, (holder,)))
        behind, _, over = (
            pose_of(after, holder)
            .inverse()
            .apply(pose_of(after, after.layout.of_type(DOMAIN.types[0])[0]).position)
        )
        assert after[holder].tobytes() == state[holder].tobytes()  # it was not touched
        assert behind > 0.12
        assert 0.1 < over < 0.2


@pytest.mark.parametrize("pushed", [(-1.0, 1.0), (1.0, -1.0)])
def test_a_hand_that_is_pressed_against_the_holder_leaves_the_pod_in_it(pushed):
    """Walls that let it go with a jerk would let it tear the pod out."""
    acquisition = DOMAIN.acquisition
    state = inserted(DOMAIN.task(5).initial_state)
    pod, holder = map(state.layout.object, ("pod", "holder"))
    x, y, _ = position_of(state, pod)
    with DOMAIN.make_world(state) as world:
        around = HandGoal((x, y, 0.033), yaw=0.4)
        carry_out(world, follow(*over(state, around, OPEN, 0.2), Move(around, OPEN)))
        aside, ahead = pushed
        for _ in range(4):
            world.step(np.array([MAX_SHIFT * aside, MAX_SHIFT * ahead, -MAX_SHIFT, 0.0, -1.0]))
        target, _ = hand_target(world.state)
        assert math.dist(target, hand_position(world.state)) > 0.02
        before = atoms(DOMAIN, world.state)
        assert "In(pod, holder)" in before
        after = carry_out(world, acquisition.approach(world.state, (holder,)))
        assert "In(pod, holder)" in atoms(DOMAIN, after)


# -- what cannot be -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("preset", "message"),
    [
        ("fair:lid=nan", "'lid' is"),
        ("fair:lid=0.2", "'lid' is .* it must be from 1.6 to 2"),
        ("paper:pod_aside=1", "'pod_aside' is .* it must be from -0.025 to 0.025"),
        ("paper:pods=2", "unknown setting 'pods'"),
    ],
)
def test_settings_that_cannot_be(preset, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain("make_coffee", preset)


def test_states_that_cannot_be_leave_the_world_usable():
    state = DOMAIN.task(13).initial_state
    with DOMAIN.make_world(state) as world:
        with pytest.raises(InvalidStateError, match="opening of holder is 3"):
            world.reset(changed(state, "holder", opening=3.0))
        with pytest.raises(InvalidStateError, match="inside one another"):
            world.reset(changed(state, "pod", z=-0.02))
        world.reset(state)
        assert world.state == state
