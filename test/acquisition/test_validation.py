# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What policies that see nothing are worth is not decided by the chance of a few trials."""

from dataclasses import replace
from weakref import WeakSet

import numpy as np
import pytest

from slap_ros.acquisition.training.validation import (
    RANDOM,
    RANDOM_ROUNDS,
    SIDE_BY_SIDE,
    SkillTrials,
)
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


def test_no_world_outlives_the_trials_over_its_objects():
    """A simulation takes tens of megabytes, and each state may be one over other objects."""
    alive, most = WeakSet(), [0]

    def make_world(state):
        world = POINTS.make_world(state)
        alive.add(world)
        most.append(len(alive))
        return world

    few = range(SIDE_BY_SIDE + 2)
    domain = replace(POINTS, make_world=make_world)
    trials = SkillTrials(domain, REWARD, begin(PICK, few), HORIZON)
    assert trials.success(lambda observations: np.zeros((len(observations), 3))) == 0.0
    assert max(most) == SIDE_BY_SIDE
    assert not alive
