# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ten things, each of which is picked and put into the basket; and nothing less does."""

from __future__ import annotations

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.room import within_reach
from slap_ros.domains.benchtop.state_access import yaw_of
from slap_ros.domains.groceries.model import NAMES, REWARDS
from slap_ros.domains.groceries.scenery import GROCERIES, INNER, OUTER, WALL_HEIGHT
from slap_ros.domains.groceries.tasks import basket_station, grasp_goal, station
from slap_ros.errors import InvalidParameterError, UnknownObjectError
from slap_ros.relational import Column
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.panda import FINGER_OPEN
from support.skill_starts import CONSTANT, achieves, skill_starts

DOMAIN = get_domain("groceries")


def names_of(state):
    return [obj.name for obj in state.objects if obj.name in NAMES]


@pytest.mark.parametrize("number", range(10))
def test_every_thing_is_picked_and_placed(number):
    domain = open_domain(DomainChoice("groceries", skills="demonstrator"))
    shown = demonstrate(domain, domain.task(number, goal=f"task{number}"))
    assert shown.episode.success
    assert [(edge.option, edge.objects) for edge in shown.episode.edges] == [
        ("Pick", (NAMES[number],)),
        ("Place", (NAMES[number], "basket")),
    ]


def test_tasks_differ_and_have_six_of_ten_things():
    tasks = [DOMAIN.task(seed) for seed in range(20)]
    assert len({task.initial_state.key for task in tasks}) == 20
    assert all(len(set(names_of(task.initial_state))) == 6 for task in tasks)
    assert {name for task in tasks for name in names_of(task.initial_state)} == set(NAMES)
    assert len({str(atom) for task in tasks for atom in task.goal}) > 5


@pytest.mark.parametrize("preset", ["fair:task=3", "paper:task=3"])
def test_a_task_can_be_asked_for(preset):
    domain = get_domain("groceries", preset)
    for seed in range(5):
        task = domain.task(seed)
        assert {str(atom) for atom in task.goal} == {"In(cereal, basket)"}
        assert task.goal == domain.goals["task3"](task.initial_state)
        assert task.goal == domain.task(seed, goal="task3").goal


def test_a_goal_about_a_thing_that_is_not_there():
    state = next(
        task.initial_state
        for task in map(DOMAIN.task, range(20))
        if "bottle" not in names_of(task.initial_state)
    )
    with pytest.raises(UnknownObjectError, match="unknown object 'bottle'; the task has basket"):
        DOMAIN.goals["task0"](state)


@pytest.mark.parametrize(
    ("preset", "message"),
    [
        ("fair:things=0", "'things' is 0; it must be from 1 to 10"),
        ("fair:task=10", "'task' is 10; it must be from -1 to 9"),
        ("fair:x=nan", "'x' is"),
        ("paper:things=7", "'things' is 7; it must be from 1 to 6"),
        ("paper:aside=0.1", "'aside' is 0.1; it must be from 0 to 0.02"),
    ],
)
def test_settings_that_cannot_be(preset, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain("groceries", preset)


def test_no_room_is_said():
    domain = get_domain("groceries", "fair:x=0.5,y=0.4..0.42")
    with pytest.raises(InvalidParameterError, match="no room for 6 things"):
        domain.task(0)


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_the_hand_has_room_everywhere(preset):
    domain = get_domain("groceries", preset)
    for seed in range(5):
        state = domain.task(seed).initial_state
        basket, *things = state.objects[1:]
        stations = [basket_station(pose_of(state, basket))]
        for thing in things:
            kind, pose = GROCERIES[thing.name], pose_of(state, thing)
            here = station(kind, pose)
            assert all(map(here.leaves_room, stations))
            assert within_reach(grasp_goal(kind, pose, yaw_of(state, thing)))
            stations.append(here)


def test_things_differ_in_shape_and_width():
    shapes = {thing.body.bounding_box.half for thing in GROCERIES.values()}
    widths = sorted(2.0 * thing.half_width for thing in GROCERIES.values())
    assert len(shapes) == 10
    assert widths[0] < 0.03
    assert 0.06 < widths[-1] < 2.0 * FINGER_OPEN - 0.015
    assert len({len(thing.body.parts) for thing in GROCERIES.values()}) == 3


def test_learners_observe_which_thing_it_is():
    """Its sizes are among its features, so that one policy can pick all of them."""
    state = DOMAIN.task(0).initial_state.alone()
    things = Column(tuple(state.layout.object(name) for name in names_of(state)))
    interface = DOMAIN.learning.interface
    features = interface.objects(state, interface.hand(state), things)[0]
    assert features.shape == (6, 14)
    sizes = ("rest_height", "half_width", "grasp_height")
    assert (features[:, -3:] == state.gather(things, sizes)[0] / 0.05).all()
    assert len(np.unique(features[:, -3:], axis=0)) == 6


@pytest.mark.parametrize("number", range(10))
def test_the_reward_of_pick_is_highest_where_the_thing_is_grasped(number):
    """Not over its middle: a hand that is led there presses on a bottle and never closes."""
    state = DOMAIN.task(0, goal=f"task{number}").initial_state
    thing = state.layout.object(NAMES[number])
    (robot,) = state.layout.of_type(ROBOT)
    kind, pose = GROCERIES[NAMES[number]], pose_of(state, thing)
    x, y, z = grasp_goal(kind, pose, yaw_of(state, thing)).position

    def dense(dx, dz):
        there = state.replace({(robot, "x"): x + dx, (robot, "y"): y, (robot, "z"): z + dz})
        terms = REWARDS["Pick"].terms
        one = [term.metric.normalised(there.alone(), Column((thing,)))[0, 0] for term in terms]
        return sum(term.weight * value for term, value in zip(terms, one, strict=True))

    highest = dense(0.0, 0.0)
    assert highest == pytest.approx(0.6, abs=0.01)  # and the thing is not lifted yet
    assert all(dense(*off) < highest for off in ((0.0, 0.01), (0.0, -0.01), (0.01, 0.0)))


def test_opening_and_constant_motions_do_nothing_useful():
    """What is dropped into the basket is not where it is to be."""
    done = dict.fromkeys(CONSTANT, 0)
    for number in (0, 8):
        for operator, (objects, start) in skill_starts(
            DOMAIN, DOMAIN.task(0, goal=f"task{number}")
        ).items():
            for name, action in CONSTANT.items():
                done[name] += achieves(DOMAIN, operator, objects, start, action)
    assert max(done.values()) <= 1, done


def test_a_thing_in_the_basket_is_neither_on_the_table_nor_in_the_hand():
    """Its floor lifts what stands on it, so that Holding ends when the fingers open."""
    task = DOMAIN.task(0)
    state = task.initial_state
    thing, basket = state.layout.object(names_of(state)[0]), state.layout.object("basket")
    floor = float(state.get(basket, "z"))
    there = {
        (thing, "x"): float(state.get(basket, "x")) + 0.009,
        (thing, "y"): float(state.get(basket, "y")),
        (thing, "z"): floor + float(state.get(thing, "rest_height")),
    }
    space = DOMAIN.atom_space(state)

    def atoms(**held):
        changed = state.replace({**there, (thing, "held"): held.get("held", 0.0)})
        names = {str(atom) for atom in space.decode(space.abstract(changed))}
        return {name for name in names if thing.name in name or name[:2] in ("Ha", "Is")}

    assert atoms() == {f"In({thing}, basket)", "HandEmpty()"}
    assert atoms(held=1.0) == {f"Holding({thing})"}


def test_the_open_hand_fits_between_the_walls():
    """Its stems are 67 mm out, 9 mm over the grasp point; the palm stays over the walls."""
    assert INNER - 0.0669 > 0.01
    lowest = min(thing.rest_height + thing.grasp_height for thing in GROCERIES.values())
    assert lowest + 0.0374 > WALL_HEIGHT
    assert np.hypot(OUTER, OUTER) < 0.13
