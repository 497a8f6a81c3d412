# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What policies that see nothing are worth is not decided by the chance of a few trials."""

import numpy as np
import pytest

from slap_ros.acquisition.training.validation import RANDOM, RANDOM_ROUNDS, SkillTrials
from slap_ros.skills.reward import SkillReward
from support.points import HORIZON, INTERFACE, PICK, POINTS, REWARDS, begin

REWARD = SkillReward(PICK, REWARDS["Pick"], INTERFACE)


def vacuity(tasks, seed):
    trials = SkillTrials(POINTS, REWARD, begin(PICK, tasks), HORIZON)
    return trials.vacuity(np.random.default_rng(seed))


def test_random_actions_are_tried_several_times_from_every_state():
    few = range(6)
    found = [vacuity(few, seed) for seed in range(4)]
    assert found == [vacuity(few, seed) for seed in range(4)]
    best = [one for one in found if one.policy == RANDOM]
    assert best  # in this domain they find the object now and then
    assert {one.trials for one in best} == {len(few) * RANDOM_ROUNDS}
    whole = [one.success * len(few) for one in best]
    assert any(successes % 1 for successes in whole)  # shares that no single round has


@pytest.mark.slow
def test_its_spread_over_seeds_is_that_of_all_trials():
    """Of one round it would be more than twice as large."""
    few = range(10)
    shares = [vacuity(few, seed).success for seed in range(30)]
    p = np.mean(shares)
    assert np.std(shares) == pytest.approx(np.sqrt(p * (1 - p) / (len(few) * RANDOM_ROUNDS)), 0.5)
