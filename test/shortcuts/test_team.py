# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Practice in several processes, against the same in one."""

from dataclasses import fields, replace
from multiprocessing import active_children

import numpy as np
import pytest
from pushing import SIGNATURE, STARTS

from slap_ros.errors import InvalidStateError
from slap_ros.shortcuts.practice import Rewards, Steps
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.team import Exercise, practising

RECORDS = tuple(
    StartRecord(21, index, tuple(start.state.data), start.change.add, start.change.delete)
    for index, start in enumerate(STARTS)
)
EXERCISES = [
    Exercise("obstacle2d", "fair", SIGNATURE, RECORDS, 5, 12, Rewards(), (3, part))
    for part in range(3)
]


def walk(episodes, count=30):
    rng = np.random.default_rng(8)
    yield episodes.observations
    for _ in range(count):
        steps = episodes.step(rng.uniform(-1, 1, (episodes.episodes, episodes.actions.size)))
        assert np.array_equal(episodes.observations, steps.observations)
        yield from (getattr(steps, field.name) for field in fields(Steps))


def test_how_many_processes_there_are_makes_no_difference():
    walks = []
    for processes in (1, 2, 3):
        with practising(EXERCISES, processes) as episodes:
            assert (episodes.episodes, episodes.horizon) == (15, 12)
            walks.append(list(walk(episodes)))
    for one, other in zip(walks[0], walks[1], strict=True):
        assert one.tobytes() == other.tobytes()
    for one, other in zip(walks[0], walks[2], strict=True):
        assert one.tobytes() == other.tobytes()


def test_parts_differ_from_one_another():
    with practising(EXERCISES, 2) as episodes:
        states = np.split(episodes.observations, 3)
    assert not np.array_equal(states[0], states[1])


def test_a_process_that_is_killed_is_noticed():
    with practising(EXERCISES, 2) as episodes:
        active_children()[-1].kill()
        with pytest.raises(ChildProcessError, match="a process that stepped worlds ended"):
            for _ in walk(episodes):
                pass


def test_no_process_is_left():
    with practising(EXERCISES, 2) as episodes:
        next(walk(episodes))
        assert len(active_children()) == 2
    assert not active_children()


def test_what_a_process_refuses_is_raised_here():
    broken = replace(RECORDS[0], features=RECORDS[0].features[1:])
    exercises = [replace(exercise, starts=(broken,)) for exercise in EXERCISES]
    with pytest.raises(InvalidStateError), practising(exercises, 2):
        pass
