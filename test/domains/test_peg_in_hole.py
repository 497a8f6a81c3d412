# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: tasks, operators that say exactly what happens, and pegs that stay in."""

import math

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.peg_in_hole.demonstrator import acts_at, outwards
from slap_ros.domains.peg_in_hole.model import HOLE, IN, IS_CLEAR, PEG
from slap_ros.geometry.pose import IDENTITY, Pose, from_rotation_vector, from_yaw
from slap_ros.relational import Column, State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.features import POSE_NAMES, pose_of
from support.skill_starts import CONSTANT, achieves, skill_starts
from support.states import fluent_atoms, initial_states_at_rest

DOMAIN = get_domain("peg_in_hole")
INITIAL = {"HandEmpty()", "OnTable(peg1)", "OnTable(peg2)", "IsClear(hole1)", "IsClear(hole2)"}
LIMITS = (DOMAIN.action_space.low, DOMAIN.action_space.high)


def test_tasks_differ_and_begin_as_the_paper_says():
    states = initial_states_at_rest(DOMAIN, lambda layout: layout.of_type(PEG))
    assert all(fluent_atoms(state, DOMAIN) == INITIAL for state in states)


@pytest.mark.parametrize(
    ("preset", "goal", "length"),
    [("fair:clearance=8", "training", 4), ("fair:clearance=3", "test1", 4), ("paper", "test2", 2)],
)
def test_pegs_that_were_inserted_stay_in(preset, goal, length):
    """By a plan as long as the paper's, and also after they sank into their holes."""
    domain = open_domain(DomainChoice("peg_in_hole", preset, DEMONSTRATOR))
    for seed in range(2):
        task = domain.task(seed, goal=goal)
        episode = demonstrate(domain, task).episode
        assert [edge.option for edge in episode.edges] == ["Pick", "Insert"] * (length // 2)
        atoms = fluent_atoms(episode.states[-1], domain)
        assert {str(atom) for atom in task.goal} <= atoms
        with domain.make_world(episode.states[-1]) as world:
            for _ in range(20):
                world.step(np.array([0.0, 0.0, 0.01, 0.0, -1.0]))
            assert fluent_atoms(world.state, domain) == atoms


@pytest.mark.parametrize(
    ("along", "aside", "turn", "holds"),
    [
        (0.0, 0.0, 0.0, True),
        (0.0149, 0.0, 0.0, True),
        (-0.0149, 0.0, 0.0, True),
        (0.0151, 0.0, 0.0, False),
        (-0.0151, 0.0, 0.0, False),
        (0.0, 0.0099, 0.0, True),
        (0.0, 0.0101, 0.0, False),
        (0.0, 0.0, 0.31, True),
        (0.0, 0.0, -0.32, False),
        (0.0, 0.0, math.pi, True),  # both ends of a peg are alike
    ],
)
def test_what_is_in_a_hole(along, aside, turn, holds):
    state = DOMAIN.task(0).initial_state
    peg, hole = state.layout.object("peg1"), state.layout.object("hole2")
    placed = at(state, peg, pose_of(state, hole).compose(Pose((along, aside, 0.0), from_yaw(turn))))
    assert IN(peg, hole).holds(placed) == holds
    assert IS_CLEAR(hole).holds(placed) != holds


def at(state, obj, pose):
    """The state with an object elsewhere."""
    return state.replace(
        {(obj, name): value for name, value in zip(POSE_NAMES, (*pose[0], *pose[1]), strict=True)}
    )


def test_margins_agree_with_the_truth_everywhere():
    """In scattered states; pegs are lifted, held, and in and about holes."""
    rng = np.random.default_rng(0)
    begin = DOMAIN.task(1).initial_state
    pegs, holes = begin.layout.of_type(PEG), begin.layout.of_type(HOLE)
    scattered = []
    for _ in range(2000):
        state = begin
        for peg in pegs:
            near = pose_of(begin, holes[rng.integers(2)]) if rng.random() < 0.5 else IDENTITY
            off = rng.normal(0.0, 10.0 ** rng.uniform(-3, -1), 3)
            turn = from_rotation_vector(tuple(rng.normal(0.0, 0.3, 3)))
            state = at(state, peg, near.compose(Pose(tuple(off.tolist()), turn)))
            state = state.replace({(peg, "held"): float(rng.random() < 0.3)})
        scattered.append(state)
    batch, space = State.batch(scattered), DOMAIN.atom_space(begin)
    truth, seen = space.truth(batch), set()
    for i, atom in enumerate(space.atoms):
        if atom.predicate in DOMAIN.static_predicates:
            continue
        margins = atom.predicate.margin(batch, *(Column((obj,)) for obj in atom.objects))
        assert ((margins[..., 0] >= 0.0) == truth[:, i]).all()
        seen.add((atom.predicate.name, bool(truth[:, i].any()), bool(truth[:, i].all())))
    assert seen == {(p.name, True, False) for p in DOMAIN.predicates if p.margin is not None}


def test_approaches_do_not_depend_on_the_order_of_objects():
    """Operators that were not written by hand have their objects in any order."""
    for objects, start in skill_starts(DOMAIN, DOMAIN.task(1, goal="test2")).values():
        turned = objects[::-1]
        assert acts_at(start, turned) == acts_at(start, objects)
        assert outwards(start, turned) == outwards(start, objects)


def test_nothing_less_than_a_skill_picks_or_inserts():
    """After the approach; the study has figures of many more starts."""
    rng = np.random.default_rng(0)
    for operator, (objects, start) in skill_starts(DOMAIN, DOMAIN.task(0, goal="test2")).items():
        for action in (*CONSTANT.values(), rng.uniform(*LIMITS)):
            assert not achieves(DOMAIN, operator, objects, start, action)
