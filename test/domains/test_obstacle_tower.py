# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: predicates, tasks, and towers really taken apart in PyBullet."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower.model import BLOCK
from slap_ros.domains.obstacle_tower.tasks import RandomTasks, Scenery
from slap_ros.errors import ErrorCode, InvalidStateError
from slap_ros.physics.panda import MAX_STEP
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.relational import State

FAIR, PAPER = get_domain("obstacle_tower"), get_domain("obstacle_tower", "paper")


def solve(task, domain=FAIR):
    space = domain.atom_space(task.initial_state)
    return Executor(
        domain,
        make_planner("lazy", domain, task.initial_state),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
    ).run()


def atoms(state, domain=FAIR):
    space = domain.atom_space(state)
    return {str(atom) for atom in space.decode(space.abstract(state) & ~space.static)}


def test_a_tower_is_perceived_as_it_stands():
    assert atoms(PAPER.task(0).initial_state) == {
        "On(block1, table)",
        "On(block2, target)",
        "On(block3, block2)",
        "On(block4, block3)",
        "NothingOn(block1)",
        "NothingOn(block4)",
        "NothingOn(table)",
        "GripperEmpty(robot)",
        *(f"NotHolding(robot, block{i})" for i in range(1, 5)),
    }


def test_a_block_half_on_the_target_is_on_the_table_and_leaves_no_room():
    scenery = Scenery(target=(0.5, 0.0, 0.4), target_block=(0.4, 0.2, 0), tower=((0.54, 0.0, 0.9),))
    seen = atoms(scenery.task().initial_state)
    assert "On(block2, table)" in seen
    assert "On(block2, target)" not in seen
    assert "NothingOn(target)" not in seen


def test_blocks_in_the_air_or_on_edge_lie_on_nothing():
    state = Scenery((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ()).task().initial_state
    block = state.layout.object("block1")
    lifted = state.replace({(block, "z"): float(state.get(block, "z")) + 0.006})
    assert "On(block1, table)" not in atoms(lifted)
    tilt = math.radians(20)
    tilted = state.replace({(block, "qx"): math.sin(tilt / 2), (block, "qw"): math.cos(tilt / 2)})
    assert "On(block1, table)" not in atoms(tilted)


def test_a_batch_is_perceived_like_its_states():
    rng = np.random.default_rng(0)
    initial = FAIR.task(2).initial_state
    space = FAIR.atom_space(initial)
    data = initial.data + rng.uniform(-0.05, 0.05, (200, initial.layout.size))
    truth = space.truth(State(initial.layout, data))
    for row, one in zip(data, truth, strict=True):
        assert (space.truth(State(initial.layout, row)) == one).all()


def test_tasks_differ_and_stand_by_themselves():
    tasks = [FAIR.task(seed) for seed in range(30)]
    assert len({task.initial_state.key for task in tasks}) == 30
    assert len({len(task.initial_state.layout.of_type(BLOCK)) for task in tasks}) == 3
    for task in tasks[:10]:
        world = FAIR.make_world(task.initial_state)
        for _ in range(5):
            after = world.step(np.zeros(8))
        assert after == task.initial_state


@pytest.mark.parametrize("seed", range(3))
def test_random_towers_are_taken_apart_within_the_speed_limit(seed):
    task = FAIR.task(seed)
    episode = solve(task)
    assert episode.success, episode.error
    assert episode.replans == 0
    assert all(atom.holds(episode.states[-1]) for atom in task.goal)
    steps = np.abs(np.diff([state.data[:7] for state in episode.states], axis=0))
    assert (steps <= np.array(MAX_STEP) + 1e-9).all()


def test_the_paper_tower_is_solved_the_same_way_twice():
    first, second = solve(PAPER.task(0), PAPER), solve(PAPER.task(1), PAPER)
    assert first.success
    assert [s.key for s in first.states] == [s.key for s in second.states]


def test_without_obstacles_it_is_pick_and_place():
    task = Scenery((0.5, 0.0, 0.0), (0.4, 0.2, 0.3), ()).task()
    episode = solve(task)
    assert episode.success
    assert episode.plan_length < 40


def test_a_single_obstacle_and_six_can_be_sampled():
    for count in (1, 6):
        settings = RandomTasks(obstacles=(count, count), distractors=(0, 0))
        task = settings.sample(np.random.default_rng(0))
        assert len(task.initial_state.layout.of_type(BLOCK)) == count + 1


def test_a_block_out_of_reach_makes_the_task_unsolvable():
    task = Scenery((0.5, 0.0, 0.0), (0.74, 0.39, 0.0), ()).task()
    far = task.initial_state.layout.object("block1")
    state = task.initial_state.replace({(far, "x"): 0.9, (far, "z"): -0.4})  # fell off the table
    episode = solve(replace(task, initial_state=state))
    assert not episode.success
    assert episode.error.code is ErrorCode.UNSOLVABLE


def test_blocks_inside_one_another_are_refused():
    task = Scenery((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ((0.41, 0.21, 0.0),)).task()
    with pytest.raises(InvalidStateError, match="block"):
        FAIR.make_world(task.initial_state)
