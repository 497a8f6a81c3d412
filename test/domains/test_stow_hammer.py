# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hammers are stowed by the paper's plans; drawers take them along; nothing less does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.cabinet import TRAVEL
from slap_ros.domains.stow_hammer.scenery import HALF_LENGTH, RADIUS, SHAPE
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
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

DOMAIN = get_domain("stow_hammer")
SCRIPTED = open_domain(DomainChoice("stow_hammer", skills="demonstrator"))
STOW = ("Open", "Pick", "Place", "Close")


def found_in(state):
    return atoms(DOMAIN, state)


def opened(state, name, opening):
    return changed(state, name, opening=opening)


def stowed(state, hammer, cabinet, aside=0.0, up=0.0, turn=0.0):
    """The state with a hammer in the middle of a drawer, or somewhat off."""
    frame = pose_of(state, state.layout.object(cabinet))
    x, y, z = drawers.middle_of(state, state.layout.object(cabinet))
    dx, dy, _ = frame.apply((aside, 0.0, 0.0))
    px, py, _ = frame.position
    turned = frame.compose(Pose(quaternion=from_yaw(turn))).quaternion
    return put(state, hammer, Pose((x + dx - px, y + dy - py, z + RADIUS + up), turned))


def scattered(initial, count):
    """A batch in which hammers lie, hover and hang about drawers that are more or less open."""
    rng = np.random.default_rng(4)
    rows = []
    for _ in range(count):
        state = initial
        for name in ("cabinet0", "cabinet1"):
            opening = float(rng.choice([0.0, 0.01, 0.1, rng.uniform(0.0, TRAVEL)]))
            state = opened(state, name, opening)
        for name in ("hammer0", "hammer1"):
            if rng.random() < 0.7:
                off, turn = rng.normal(0.0, 0.01, 2).tolist(), float(rng.normal(0.0, 0.15))
                cabinet = str(rng.choice(["cabinet0", "cabinet1"]))
                state = stowed(state, name, cabinet, off[0], 0.5 * off[1], turn)
            else:
                z = RADIUS + float(rng.choice([0.0, 0.01, 0.02, rng.uniform(-0.02, 0.05)]))
                state = changed(state, name, z=z)
            state = changed(state, name, held=float(rng.random() < 0.3))
        rows.append(state.data)
    return State(initial.layout, np.stack(rows))


# -- tasks and plans ------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_tasks_differ_and_can_be(preset):
    domain = get_domain("stow_hammer", preset)
    names = ("hammer0", "hammer1", "cabinet0", "cabinet1")
    initial_states_at_rest(domain, lambda layout: map(layout.object, names))


@pytest.mark.parametrize(
    ("goal", "hammers", "plan"),
    [
        ("training", ("hammer0", "hammer1"), STOW + STOW),
        ("test1", ("hammer1", "hammer0"), STOW + STOW),
        ("test2", ("hammer1",), (*STOW, "Open")),
    ],
)
def test_the_demonstrator_does_what_the_paper_plans(goal, hammers, plan):
    shown = demonstrate(SCRIPTED, SCRIPTED.task(1, goal=goal))
    assert shown.episode.success
    edges = shown.episode.edges
    assert tuple(edge.option for edge in edges) == plan
    placed = [edge.objects for edge in edges if edge.option == "Place"]
    assert placed == [(name, f"cabinet{i}") for i, name in enumerate(hammers)]


def test_two_drawers_are_never_open_at_once():
    """HasFreeSpace sees to it, also of a drawer that is neither open nor closed."""
    state = DOMAIN.task(0).initial_state
    assert "HasFreeSpace()" in found_in(state)
    ajar = found_in(opened(state, "cabinet1", 0.05))
    assert not ajar & {"HasFreeSpace()", "IsCabinetOpen(cabinet1)", "IsCabinetClose(cabinet1)"}
    space = SCRIPTED.atom_space(state)
    both = space.mask(space.atom("IsCabinetOpen", (f"cabinet{i}",)) for i in range(2))
    reached, new = set(), {space.abstract(state)}
    while new:
        reached |= new
        new = {
            ground.apply(mask)
            for mask in new
            for ground in SCRIPTED.ground(space)
            if ground.applicable(mask)
        } - reached
    assert len(reached) > 20
    assert not any(mask & both == both for mask in reached)


# -- predicates -----------------------------------------------------------------------------------


@pytest.mark.parametrize("opening", [0.0, 0.1, TRAVEL])
def test_a_hammer_is_in_a_drawer_wherever_that_is(opening):
    state = stowed(opened(DOMAIN.task(2).initial_state, "cabinet1", opening), "hammer0", "cabinet1")
    assert "InCabinet(hammer0, cabinet1)" in found_in(state)
    assert not {"OnTable(hammer0)", "InCabinet(hammer0, cabinet0)"} & found_in(state)
    left = opened(state, "cabinet1", abs(opening - 0.02))
    assert "InCabinet(hammer0, cabinet1)" not in found_in(left)


@pytest.mark.parametrize(
    ("off", "holds"),
    [
        ({"aside": 0.014}, True),
        ({"aside": 0.016}, False),
        ({"up": 0.004}, True),
        ({"up": 0.006}, False),
        ({"turn": 0.19}, True),
        ({"turn": -0.21}, False),
        ({"turn": math.pi - 0.1}, True),
    ],
)
def test_how_a_hammer_must_lie(off, holds):
    state = opened(DOMAIN.task(3).initial_state, "cabinet0", TRAVEL)
    found = found_in(stowed(state, "hammer1", "cabinet0", **off))
    assert ("InCabinet(hammer1, cabinet0)" in found) == holds


def test_truth_and_margin_agree():
    batch = scattered(DOMAIN.task(4).initial_state, 2_000)
    assert_margins_agree(DOMAIN, batch)
    space = DOMAIN.atom_space(State(batch.layout, batch.data[0]))
    truth = space.truth(batch)
    held = [i for i, atom in enumerate(space.atoms) if atom.predicate.name == "Holding"]
    lying = [i for i, atom in enumerate(space.atoms) if atom.predicate.name == "OnTable"]
    assert not (truth[:, held] & truth[:, lying]).any()


def test_metrics_are_defined_alike_for_one_and_for_many():
    assert_metrics_agree(DOMAIN, scattered(DOMAIN.task(5).initial_state, 20))


# -- skills ---------------------------------------------------------------------------------------


PLAN = (
    ("Open", ("cabinet0",)),
    ("Pick", ("hammer0",)),
    ("Place", ("hammer0", "cabinet0")),
    ("Close", ("cabinet0",)),
)


def test_a_hammer_that_is_let_fall_is_not_stowed():
    """Nor does any other constant motion do what an operator says."""
    done = constant_motions(DOMAIN, DOMAIN.task(6).initial_state, PLAN)
    assert len(done) == 16
    assert not any(done.values()), done


def test_a_grasp_that_was_not_lifted_is_begun_again():
    """The hand is empty for all that predicates say, so any operator may come next."""
    state = DOMAIN.task(7).initial_state
    hammer, cabinet = map(state.layout.object, ("hammer0", "cabinet0"))
    acquisition = DOMAIN.acquisition
    with DOMAIN.make_world(state) as world:
        pick = acquisition.scripts["Pick"](state, (hammer,))
        while float(world.state.get(hammer, "held")) < 0.5:
            world.step(pick(world.state))
        grasped = world.state
        assert {"HandEmpty()", "OnTable(hammer0)"} <= found_in(grasped)
        for objects in ((hammer,), (cabinet,)):
            world.reset(grasped)
            after = carry_out(world, acquisition.approach(grasped, objects))
            assert float(after.get(hammer, "held")) == 0.0
            assert found_in(after) == found_in(grasped)


def test_a_drawer_that_is_pushed_fast_keeps_its_hammer_within_reach_of_the_goal():
    """A hammer slides in a drawer that is pushed as fast as the hand can, yet stays In."""
    state = opened(SCRIPTED.task(8).initial_state, "cabinet0", 0.15)
    state = stowed(state, "hammer0", "cabinet0")
    cabinet = state.layout.object("cabinet0")
    with SCRIPTED.make_world(state) as world:
        carry_out(world, DOMAIN.acquisition.approach(state, (cabinet,)))
        for _ in range(4):
            world.step(np.array([0.0, 0.0, -0.01, 0.0, -1.0]))
        for _ in range(15):
            world.step(np.array([0.02, 0.0, 0.0, 0.0, -1.0]))
        assert {"IsCabinetClose(cabinet0)", "InCabinet(hammer0, cabinet0)"} <= found_in(world.state)


def test_a_hammer_fits_in_a_drawer_with_some_room():
    assert 0.005 < SHAPE.half_width - HALF_LENGTH < 0.015
    assert SHAPE.headroom > 2.0 * RADIUS


# -- what cannot be -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("preset", "message"),
    [
        ("fair:hammer_x=nan", "'hammer_x' is"),
        ("fair:front_y=0.1", "'front_y' is .* it must be from 0.33 to 0.4"),
        ("paper:front_turn=2", "'front_turn' is .* it must be from -0.3 to 0.3"),
        ("paper:cabinets=3", "unknown setting 'cabinets'"),
    ],
)
def test_settings_that_cannot_be(preset, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain("stow_hammer", preset)


def test_no_room_is_said():
    with pytest.raises(InvalidParameterError, match="no room for two hammers"):
        get_domain("stow_hammer", "fair:hammer_x=0.5").task(0)


def test_states_that_cannot_be_leave_the_world_usable():
    state = DOMAIN.task(9).initial_state
    with DOMAIN.make_world(state) as world:
        with pytest.raises(InvalidStateError, match="opening of cabinet0 is 5"):
            world.reset(opened(state, "cabinet0", 5.0))
        with pytest.raises(InvalidStateError, match="inside one another"):
            lying = pose_of(state, state.layout.object("hammer0"))
            world.reset(put(state, "hammer1", lying))
        world.reset(state)
        assert world.state == state
