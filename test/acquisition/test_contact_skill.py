# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A skill of the world with contact is learned: fingers that grasp by friction."""

from dataclasses import replace

import pytest

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidStateError
from slap_ros.learning.workers import local_workers
from slap_ros.relational import State

HAMMERS = get_domain("stow_hammer")
WRITTEN = HAMMERS.acquisition
SOURCE = TaskSource.of(HAMMERS, "training", 0, WRITTEN.operators, WRITTEN.rewards)


def begin(index):
    """Where a hammer of a task is about to be picked, as data."""
    state = SOURCE.task(index).initial_state
    hammer = state.layout.by_name[f"hammer{index % 2}"]
    world = HAMMERS.make_world(state)
    approach = WRITTEN.approach(state, (hammer,))
    while (action := approach(world.state)) is not None:
        world.step(action)
    return index, (hammer.name,), tuple(map(float, world.state.data))


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(600)  # a minute of learning, on a machine that nobody else uses
def test_a_hammer_is_grasped_after_a_minute_of_learning(tmp_path):
    settings = replace(AcquisitionSettings(), skill_steps=6_000)
    starts, fresh = (tuple(begin(first + i) for i in range(20)) for first in (0, 900_000))
    with local_workers(1) as workers:  # in a process of its own, as always: worlds take memory
        states = InitiationStates(starts, ()), InitiationStates(fresh, ())
        job = jobs.LearningJob(SOURCE, "Pick", 0, *states, settings, tmp_path)
        ((_, outcome),) = workers.run(jobs.learn, [(job,)])
        ((_, vacuity),) = workers.run(jobs.vacuity, [(SOURCE, "Pick", fresh, 2)])
    assert outcome["initial"] <= 0.1
    assert outcome["segments"][outcome["best"] - 1] >= 0.9
    assert vacuity["success"] <= 0.1


def out_of_reach(start):
    """The same start, its hammer a kilometre away."""
    index, names, numbers = start
    layout = SOURCE.task(index).initial_state.layout
    state = State(layout, numbers).replace({(layout.by_name[names[0]], "x"): 1_000.0})
    return index, names, tuple(map(float, state.data))


@pytest.mark.slow
@pytest.mark.training
def test_starts_that_the_world_refuses_are_left_out_and_counted(tmp_path):
    settings = AcquisitionSettings(segment_episodes=1, skill_steps=1)
    settings = replace(settings, sac=replace(settings.sac, n_envs=2))
    good = begin(0)
    bad = out_of_reach(good)
    with local_workers(1) as workers:

        def learn(starts):
            states = InitiationStates(starts, ()), InitiationStates((good,), ())
            job = jobs.LearningJob(SOURCE, "Pick", 0, *states, settings, tmp_path)
            ((_, outcome),) = workers.run(jobs.learn, [(job,)])
            return outcome

        with pytest.raises(InvalidStateError, match="refuses all 2 states in which Pick is to be"):
            learn((bad, bad))
        assert learn((bad, good, bad))["refused"] == 2
