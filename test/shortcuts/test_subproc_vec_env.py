# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environments in several processes, against the same in one."""

from dataclasses import fields, replace
from multiprocessing import active_children

import numpy as np
import pytest

from slap_ros.errors import InvalidStateError
from slap_ros.learning.subproc_vec_env import make_vec_env
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.shortcut_env_spec import ShortcutEnvSpec
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.skills.domain_choice import DomainChoice
from support.pushing import SIGNATURE, STARTS

RECORDS = tuple(
    StartRecord(21, index, tuple(start.state.data), start.change.add, start.change.delete)
    for index, start in enumerate(STARTS)
)
OBSTACLE2D = DomainChoice("obstacle2d", "fair")
SPECS = [
    ShortcutEnvSpec(OBSTACLE2D, SIGNATURE, RECORDS, 5, 12, Rewards(), (3, part))
    for part in range(3)
]


def walk(env, count=30):
    rng = np.random.default_rng(8)
    yield env.observations
    for _ in range(count):
        steps = env.step(rng.uniform(-1, 1, (env.num_envs, env.action_map.size)))
        assert np.array_equal(env.observations, steps.observations)
        yield from (getattr(steps, field.name) for field in fields(VecEnvStep))


@pytest.mark.slow
def test_how_many_processes_there_are_makes_no_difference():
    walks = []
    for processes in (1, 2, 3):
        with make_vec_env(SPECS, processes) as env:
            assert (env.num_envs, env.horizon) == (15, 12)
            walks.append(list(walk(env)))
    for one, other in zip(walks[0], walks[1], strict=True):
        assert one.tobytes() == other.tobytes()
    for one, other in zip(walks[0], walks[2], strict=True):
        assert one.tobytes() == other.tobytes()


def test_parts_differ_from_one_another():
    with make_vec_env(SPECS, 2) as env:
        states = np.split(env.observations, 3)
    assert not np.array_equal(states[0], states[1])


def test_a_process_that_is_killed_is_noticed():
    with make_vec_env(SPECS, 2) as env:
        active_children()[-1].kill()
        with pytest.raises(ChildProcessError, match="a process that stepped worlds ended"):
            for _ in walk(env):
                pass


def test_no_process_is_left():
    with make_vec_env(SPECS, 2) as env:
        next(walk(env))
        assert len(active_children()) == 2
    assert not active_children()


def test_what_a_process_refuses_is_raised_here():
    broken = replace(RECORDS[0], features=RECORDS[0].features[1:])
    specs = [replace(spec, starts=(broken,)) for spec in SPECS]
    with pytest.raises(InvalidStateError), make_vec_env(specs, 2):
        pass
