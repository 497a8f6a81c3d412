# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts that begin with an approach: the hand goes round an object before it pushes."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.approach import DISTANCE
from slap_ros.domains.benchtop.state_access import hand_position, held_thing, yaw_of
from slap_ros.domains.stack_at_target.scenery import CUBE_HALF
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.approaches import (
    APPROACHED,
    MOST_STEPS,
    Approacher,
    approach_name,
    sides_of,
)
from slap_ros.shortcuts.demonstrations import (
    ShortcutDemonstration,
    demonstrate,
    most_demonstration_steps,
)
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.exploration_steps import usual_steps
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.named_settings import APPROACHES, training_settings
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate
from slap_ros.shortcuts.starts import find_start, restore_starts
from slap_ros.skills.domain_choice import DomainChoice, open_domain

SEED = 300  # of tasks for development
PUSH = 25  # environment steps


def explore(domain, settings, planned=None):
    """What is found in a task, which is planned for first unless it was."""
    if planned is None:
        return Explorer.of_task(domain, SEED, 0, settings, np.random.default_rng(SEED)).explore()
    return Explorer(domain, *planned, settings, np.random.default_rng(SEED)).explore()


@pytest.fixture(scope="module")
def coffee():
    return open_domain(DomainChoice("make_coffee", "fair", "models/skills/make_coffee"))


@pytest.fixture(scope="module")
def settings(coffee):
    return replace(training_settings(APPROACHES, coffee).exploration, nodes=4)


@pytest.fixture(scope="module")
def planned(coffee):
    """A task with its plan. What is executed in its model is executed once."""
    task = coffee.task(SEED)
    problem = Problem.of(coffee, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    return problem, task, GraphPlanner(problem).plan(task.initial_state, goal).plan


@pytest.fixture(scope="module")
def found(coffee, settings, planned):
    return explore(coffee, settings, planned)


@pytest.fixture(scope="module")
def candidate(found):
    return max(found.candidates, key=lambda candidate: candidate.expected_saving)


def test_a_drawer_is_shut_with_the_pod_in_the_hand_which_no_operator_says(candidate):
    """Between the drawer's handle and the arm, a hand that has just picked the pod is not."""
    assert candidate.found_by == (APPROACHED,) and candidate.beyond
    assert candidate.operator_path == ("Open", "Pick")
    assert candidate.signature.context == {"Holding"}
    assert "IsCabinetClose" in {predicate for predicate, _ in candidate.signature.add}
    assert 0.0 < candidate.expected_saving < candidate.plan_steps
    assert ShortcutCandidate.from_json(candidate.as_json()) == candidate


def test_without_the_approach_it_is_not_found(coffee, settings, planned):
    assert not explore(coffee, replace(settings, approaches=0), planned).candidates


def test_a_budget_is_kept_by_approaches_too(coffee, settings, planned, found):
    budget = found.environment_steps // 2
    assert explore(coffee, replace(settings, budget=budget), planned).environment_steps <= budget


def test_steps_of_approaches_are_counted_before_they_are_taken(coffee, settings, found):
    none = replace(settings, approaches=0)
    most = usual_steps(coffee, replace(settings, tasks=1), 40)
    assert usual_steps(coffee, replace(none, tasks=1), 40) < found.environment_steps < most


def test_an_approach_with_a_push_is_shown_in_other_tasks_and_made_shorter(coffee, found, candidate):
    about = candidate.signature, candidate.operator_path, found.operator_steps
    start = find_start(coffee, SEED, 1, *about, beyond=True)

    def show():
        rng = np.random.default_rng(0)
        return demonstrate(coffee, start, candidate.signature, 30, rng, push=PUSH).shown

    shown = show()
    assert shown == show()
    assert len(shown.actions) < shown.replaced < MOST_STEPS + PUSH
    assert shown.approach == "cabinet from +y"  # towards which the drawer opens
    assert ShortcutDemonstration.from_json(shown.as_json()) == shown
    skills = demonstrate(coffee, start, candidate.signature, 30, np.random.default_rng(0))
    assert skills.shown is None
    most = most_demonstration_steps(coffee, candidate.signature, 31, 60, PUSH)
    assert 0 < shown.environment_steps < most
    (begin,) = restore_starts(coffee, [start])
    assert held_thing(begin.state) is not None


def test_an_approach_ends_before_the_object_on_each_side_where_there_is_room():
    domain = get_domain("stack_at_target")
    state = domain.task(SEED).initial_state
    cube = state.layout.object("cube0")
    approacher = Approacher(domain, state)
    ended = list(approacher.approach(state, cube))
    assert 3 <= len(ended) <= len(sides_of(domain, state, cube)) == 5
    middle = np.array([state.get(cube, axis) for axis in "xyz"])
    for approached in ended:
        way = middle - np.array(hand_position(approached.state))
        assert np.linalg.norm(way) == pytest.approx(CUBE_HALF + DISTANCE, abs=0.005)
        onwards = approached.onwards[:3] / np.linalg.norm(approached.onwards[:3])
        assert way @ onwards == pytest.approx(CUBE_HALF + DISTANCE, abs=0.005)
    assert approacher.steps == sum(len(approached.commands) for approached in ended)


def test_a_side_is_named_in_the_frame_of_the_object_and_so_is_the_approach():
    """A cube that is turned has its sides elsewhere: +x is where its own x axis points."""
    domain = get_domain("stack_at_target")
    state = domain.task(SEED).initial_state
    for cube in (state.layout.object("cube0"), state.layout.object("cube1")):
        axis = np.array([np.cos(yaw_of(state, cube)), np.sin(yaw_of(state, cube)), 0.0])
        ways = {side.side: side.onwards[:3] for side in sides_of(domain, state, cube)}
        assert list(ways) == ["above", "+x", "+y", "-x", "-y"]
        assert ways["+x"] / np.linalg.norm(ways["+x"]) == pytest.approx(-axis)
        assert ways["-x"] == pytest.approx(-ways["+x"])
        assert ways["above"][2] < 0.0 == ways["above"][0] == ways["above"][1]
    assert approach_name(cube, "+x") == f"{cube.type.name} from +x"
    assert approach_name(cube, "") == cube.type.name


def test_where_a_domain_knows_no_approaches_there_are_none():
    domain = get_domain("obstacle2d")
    few = ExplorationSettings(rollouts=4, length=12, nodes=2)
    assert explore(domain, replace(few, approaches=1)) == explore(domain, few)
    assert "approaches" not in few.as_json()
