# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Margins tell the truth, and how far it is from changing; tolerances do not flatten them."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.model import RESTING_TOLERANCE
from slap_ros.domains.obstacle2d.tasks import make_task
from slap_ros.domains.obstacle_tower.support import TOUCHING
from slap_ros.domains.obstacle_tower.tasks import TowerArrangement
from slap_ros.relational import Column, State
from slap_ros.worlds.joint_space.scene import CUBE_EDGE
from support.random_states import one_by_one, random_states
from support.scattered_states import BENCHTOP, scattered

DOMAINS = {name: get_domain(name) for name in ("obstacle2d", "obstacle_tower")}
TOWER, FLAT = DOMAINS["obstacle_tower"], DOMAINS["obstacle2d"]


def margin(domain, state, name, *objects):
    predicate = next(p for p in domain.predicates if p.name == name)
    columns = [Column((state.layout.object(obj),)) for obj in objects]
    return predicate.margin(state, *columns)[..., 0]


def moved(state, obj, feature, values):
    """A batch, one state for each value."""
    data = np.repeat(state.data[None], len(values), axis=0)
    data[:, state.layout.column(state.layout.object(obj), feature)] = values
    return State(state.layout, data)


def test_the_tower_is_perceived_as_spelled_out_one_by_one():
    rng = np.random.default_rng(0)
    seen = 0
    for seed in range(5):
        initial = TOWER.task(seed).initial_state
        space = TOWER.atom_space(initial)
        bodies = [space.bit(a) for a in space.atoms if a.predicate.name in ("On", "NothingOn")]
        for row in random_states(initial, rng, 60).data:
            state = State(initial.layout, row)
            found = {str(a) for a in space.decode(space.abstract(state) & sum(bodies))}
            assert found == one_by_one(state)
            seen += sum(name.startswith("On") for name in found)
    assert seen > 300


@pytest.mark.parametrize("name", DOMAINS)
def test_a_margin_is_positive_exactly_where_its_atom_holds(name):
    domain, rng = DOMAINS[name], np.random.default_rng(1)
    initial = domain.task(0).initial_state
    if domain is TOWER:
        batch = random_states(initial, rng, 300)
    else:
        columns = [initial.layout.column(b, "x") for b in initial.objects if "block" in b.name]
        data = np.repeat(initial.data[None], 300, axis=0)
        data[:, columns] = np.round(rng.uniform(0, 1, (300, len(columns))), 2)
        heights = [initial.layout.column(b, "y") for b in initial.objects if "block" in b.name]
        data[:, heights] = rng.choice([0.0, 1e-6, 2e-6], (300, len(heights)))
        batch = State(initial.layout, data)
    space = domain.atom_space(initial)
    truth = space.truth(batch)
    for i, atom in enumerate(space.atoms):
        if atom.predicate.margin is not None:
            columns = [Column((obj,)) for obj in atom.objects]
            positive = atom.predicate.margin(batch, *columns)[..., 0] >= 0.0
            assert (positive == truth[:, i]).all()


@pytest.mark.parametrize("name", BENCHTOP)
def test_a_margin_at_a_bench_is_positive_exactly_where_its_atom_holds(name):
    """Every fluent predicate has one, and is seen to hold and not to hold."""
    domain, batch = get_domain(name), scattered(name)
    space = domain.atom_space(domain.task(0).initial_state)
    truth = space.truth(batch)
    held, missed = set(), set()
    for i, atom in enumerate(space.atoms):
        if atom.predicate in domain.static_predicates:
            continue
        assert atom.predicate.margin is not None
        columns = [Column((obj,)) for obj in atom.objects]
        margins = atom.predicate.margin(batch, *columns)[..., 0]
        assert np.isfinite(margins).all()
        assert ((margins >= 0.0) == truth[:, i]).all()
        held |= {atom.predicate.name} if truth[:, i].any() else set()
        missed |= {atom.predicate.name} if not truth[:, i].all() else set()
    fluent = {p.name for p in domain.predicates} - {p.name for p in domain.static_predicates}
    assert held == missed == fluent


def sliding(yaw, gap):
    """A block that lies slightly above the table and slides off the target, along x."""
    state = (
        TowerArrangement((0.5, 0.0, yaw), (0.4, 0.3, 0.0), ((0.5, 0.0, 0.0),)).task().initial_state
    )
    state = state.replace({(state.layout.object("block2"), "z"): 0.1 + gap})
    return moved(state, "block2", "x", np.linspace(0.5, 0.58, 100))


@pytest.mark.parametrize("yaw", [0.0, 0.4])
@pytest.mark.parametrize("gap", [0.0, 0.001, -0.002])
def test_a_block_that_slides_off_the_target_leaves_ever_more_room(yaw, gap):
    room = margin(TOWER, sliding(yaw, gap), "NothingOn", "target")
    assert (np.diff(room) > 0).all()
    assert room[0] < -CUBE_EDGE / 2  # a whole block is to be moved, not millimetres
    assert room[-1] > 0


@pytest.mark.parametrize("gap", [0.0, 0.001, -0.002])
def test_a_block_that_slides_off_the_target_is_ever_less_in_it(gap):
    assert (np.diff(margin(TOWER, sliding(0.0, gap), "On", "block2", "target")) < 0).all()


def test_a_block_that_slides_off_another_lies_ever_less_on_it():
    tower = ((0.5, 0.0, 0.0),) * 2
    state = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.3, 0.0), tower).task().initial_state
    slid = moved(state, "block3", "x", np.linspace(0.5, 0.56, 100))
    assert (np.diff(margin(TOWER, slid, "On", "block3", "block2")) < 0).all()
    assert (np.diff(margin(TOWER, slid, "NothingOn", "block2")) > 0).all()


def test_a_lifted_block_leaves_without_a_jump():
    state = (
        TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.3, 0.0), ((0.5, 0.0, 0.0),)).task().initial_state
    )
    heights = 0.1 + np.linspace(-0.01, 0.01, 20001)
    for name, objects in (("On", ("block2", "target")), ("NothingOn", ("target",))):
        found = margin(TOWER, moved(state, "block2", "z", heights), name, *objects)
        assert np.abs(np.diff(found)).max() < 1e-4  # for a micrometre
        kept = np.abs(heights - 0.1) < TOUCHING - 1e-9
        assert ((found > 0) == (kept if name == "On" else ~kept))[1:-1].mean() > 0.999


def test_obstacle2d_counts_the_distance_sideways_only():
    state = make_task((0.5, 1.0), 0.5, [0.1, 0.5]).initial_state
    slid = moved(state, "block2", "x", np.linspace(0.5, 0.9, 100))
    for name, objects, sign in (
        ("Clear", ("target",), 1),
        ("Overlap", ("block2", "target"), -1),
        ("On", ("block2", "target"), -1),
        ("On", ("block2", "table"), 1),
    ):
        assert (np.diff(sign * margin(FLAT, slid, name, *objects)) > 0).all()
    assert margin(FLAT, slid, "Clear", "target")[0] < -0.19
    on_edge = moved(state, "block2", "y", [RESTING_TOLERANCE, 2 * RESTING_TOLERANCE])
    assert margin(FLAT, on_edge, "Overlap", "block2", "target").tolist() == [0.0, -1e-6]
