# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bowl is grasped at its rim, wherever it stands, and put on the plate; nothing less does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.state_access import position_of
from slap_ros.domains.bowls.model import SPOTS
from slap_ros.domains.bowls.scenery import FURNITURE, OUTSIDE, REST_HEIGHT
from slap_ros.domains.bowls.tasks import bowl_station, fixed_station
from slap_ros.errors import InvalidParameterError, UnknownObjectError
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.features import pose_of
from support.skill_starts import CONSTANT, achieves, skill_starts

DOMAIN = get_domain("bowls")


def bowls_of(state):
    return [obj for obj in state.objects if obj.type.name == "bowl"]


@pytest.mark.parametrize("number", range(10))
def test_bowls_are_brought_from_every_spot(number):
    domain = open_domain(DomainChoice("bowls", skills="demonstrator"))
    shown = demonstrate(domain, domain.task(number, goal=f"task{number}"))
    assert shown.episode.success
    assert [(edge.option, edge.objects) for edge in shown.episode.edges] == [
        ("Pick", (f"bowl{number}",)),
        ("Place", (f"bowl{number}", "plate")),
    ]


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_bowls_stand_where_their_number_says(preset):
    domain = get_domain("bowls", preset)
    on_top = {3: "cookies", 4: "tray", 5: "ramekin", 7: "stove", 9: "cabinet"}
    beside = {1: "ramekin", 6: "cookies", 8: "plate"}
    for number in range(len(SPOTS)):
        state = domain.task(0, goal=f"task{number}").initial_state
        x, y, z = position_of(state, state.layout.object(f"bowl{number}"))
        if number in on_top:
            u, v, w = position_of(state, state.layout.object(on_top[number]))
            assert math.hypot(x - u, y - v) < 0.015
            assert z - REST_HEIGHT == pytest.approx(w)
            continue
        assert z == REST_HEIGHT
        if number in beside:
            u, v, _ = position_of(state, state.layout.object(beside[number]))
            assert OUTSIDE < math.hypot(x - u, y - v) < 0.18
        elif number == 0:
            ends = (position_of(state, state.layout.object(n)) for n in ("plate", "ramekin"))
            u, v, _ = np.mean(list(ends), axis=0)
            assert math.hypot(x - u, y - v) < 0.015


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_the_hand_has_room_everywhere(preset):
    domain = get_domain("bowls", preset)
    for seed in range(5):
        state = domain.task(seed).initial_state
        plate, *others = state.objects[1:]
        stations = [fixed_station("plate", pose_of(state, plate))]
        for obj in others:
            pose = pose_of(state, obj)
            is_bowl = obj.type.name == "bowl"
            here = bowl_station(pose, pose_of(state, plate)) if is_bowl else None
            here = here or fixed_station(obj.name, pose)
            assert all(map(here.leaves_room, stations))
            stations.append(here)


def test_tasks_differ():
    tasks = [DOMAIN.task(seed) for seed in range(20)]
    assert len({task.initial_state.key for task in tasks}) == 20
    assert all(len(bowls_of(task.initial_state)) == 2 for task in tasks)
    assert len({str(atom) for task in tasks for atom in task.goal}) > 5


@pytest.mark.parametrize("preset", ["fair:task=9", "paper:task=9"])
def test_a_task_can_be_asked_for(preset):
    domain = get_domain("bowls", preset)
    for seed in range(3):
        task = domain.task(seed)
        assert {str(atom) for atom in task.goal} == {"On(bowl9, plate)"}
        assert task.goal == domain.task(seed, goal="task9").goal


def test_a_goal_about_a_bowl_that_is_not_there():
    state = DOMAIN.task(0).initial_state
    absent = next(n for n in range(10) if f"bowl{n}" not in state.layout.by_name)
    with pytest.raises(UnknownObjectError, match=f"unknown object 'bowl{absent}'; the task has"):
        DOMAIN.goals[f"task{absent}"](state)


@pytest.mark.parametrize(
    ("preset", "message"),
    [
        ("fair:bowls=0", "'bowls' is 0; it must be from 1 to 3"),
        ("paper:task=10", "'task' is 10; it must be from -1 to 9"),
        ("paper:aside=-1", "'aside' is -1"),
    ],
)
def test_settings_that_cannot_be(preset, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain("bowls", preset)


def test_no_room_is_said():
    with pytest.raises(InvalidParameterError, match="no room was found for bowls"):
        get_domain("bowls", "fair:x=0.5,y=0.4").task(0)


def test_surfaces_count_as_the_table_and_the_plate_does_not():
    state = get_domain("bowls", "paper:task=9").task(0).initial_state
    bowl, other = bowls_of(state)[:2]
    space = DOMAIN.atom_space(state)

    def atoms(position, held=0.0):
        changes = {(bowl, axis): v for axis, v in zip("xyz", position, strict=True)}
        changed = state.replace({**changes, (bowl, "held"): held})
        found = {str(atom) for atom in space.decode(space.abstract(changed))}
        return found - {f"OnTable({other})"}

    def above(name, height):
        x, y, z = position_of(state, state.layout.object(name))
        return x + 0.006, y, z + REST_HEIGHT + height

    for name in FURNITURE:
        assert atoms(above(name, 0.0)) == {f"OnTable({bowl})", "HandEmpty()", "IsClear(plate)"}
        assert atoms(above(name, 0.03), held=1.0) == {f"Holding({bowl})", "IsClear(plate)"}
    assert atoms(above("plate", 0.0)) == {f"On({bowl}, plate)", "HandEmpty()"}
    assert atoms(above("plate", 0.0), held=1.0) == {f"Holding({bowl})"}
    assert atoms(above("plate", 0.04), held=1.0) == {f"Holding({bowl})", "IsClear(plate)"}


@pytest.mark.slow
def test_every_bowl_stands_on_the_table_or_on_furniture_at_first():
    """Beside a corner of the furniture, too."""
    for goal in ("task2", "task6"):
        for index in range(40):
            state = DOMAIN.task(500, index, goal).initial_state
            space = DOMAIN.atom_space(state)
            held = {str(atom) for atom in space.decode(space.abstract(state))}
            assert {f"OnTable({bowl})" for bowl in bowls_of(state)} <= held
            assert all(abs(float(state.get(bowl, "y"))) < 0.5 - OUTSIDE for bowl in bowls_of(state))


@pytest.mark.slow
def test_constant_motions_do_nothing_useful():
    done = dict.fromkeys(CONSTANT, 0)
    for number in (2, 7):
        task = DOMAIN.task(0, goal=f"task{number}")
        for operator, (objects, start) in skill_starts(DOMAIN, task).items():
            for name, action in CONSTANT.items():
                done[name] += achieves(DOMAIN, operator, objects, start, action)
    assert max(done.values()) <= 1, done
