# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search that learned nothing has the budget of the one that did, and none of its knowledge."""

from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError
from slap_ros.evaluation.approaches import approaches, shooting
from slap_ros.evaluation.experiment import Experiment
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shooting import RandomActions
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary, load_library, save_library

DOMAIN = get_domain("obstacle2d")
LIBRARY = load_library(Path(__file__).parent / "data" / "obstacle2d", DOMAIN)


def test_actions_are_kept_for_some_steps_and_differ_between_rollouts():
    observations = np.zeros((5, 3), dtype=np.float32)
    sample = RandomActions(actions=2, hold=4).sampler(np.random.default_rng(0))
    actions = np.array([sample(step, observations) for step in range(8)])
    assert (actions[:4] == actions[0]).all()
    assert (actions[4:] == actions[4]).all()
    assert not (actions[0] == actions[4]).any()
    assert len(np.unique(actions[0])) == actions[0].size
    assert np.abs(actions).max() <= 1.0


def test_no_more_rollouts_than_with_a_policy_and_none_left_out():
    sampling = Sampling(samples=3)
    ours = approaches(LIBRARY, sampling)[-1]
    alone = shooting(LIBRARY, DOMAIN, sampling)
    assert (alone.sampling.samples, alone.sampling.batch) == (ours.sampling.samples, 32)
    assert alone.sampling.patience > alone.sampling.samples * alone.sampling.batch
    assert all(isinstance(s.policy, RandomActions) and s.shortest == 1 for s in alone.shortcuts)


def test_it_solves_tasks_and_says_the_same_again():
    experiment = Experiment(DOMAIN, 2, 1)
    alone = shooting(LIBRARY, DOMAIN, Sampling(samples=2))
    runs = [[experiment.run(*which, alone) for which in experiment] for _ in range(2)]
    assert all(run.success for run in runs[0])
    assert [r.plan_length for r in runs[0]] == [r.plan_length for r in runs[1]]


def test_it_is_no_library(tmp_path):
    alone = shooting(LIBRARY, DOMAIN, Sampling())
    with pytest.raises(InvalidLibraryError, match="no learned policy that could be stored"):
        save_library(tmp_path / "library", ShortcutLibrary("obstacle2d", alone.shortcuts))
    assert not (tmp_path / "library").exists()
