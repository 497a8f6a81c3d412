# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Intervals hold what they claim to hold."""

import numpy as np
import pytest

from slap_ros.evaluation.statistics import (
    SuccessRate,
    mean_interval,
    ratio_interval,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [  # Newcombe 1998, Table I, method 3: the score interval
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_success_rates_as_published(successes, trials, low, high):
    interval = wilson_interval(successes, trials)
    assert (round(interval.low, 4), round(interval.high, 4)) == (low, high)
    rate = SuccessRate(successes, trials)
    assert (rate.share, rate.interval) == (successes / trials, interval)
    assert str(rate) == f"{successes / trials:.0%} [{interval.low:.0%}, {interval.high:.0%}]"


def test_all_and_none_are_each_others_mirror():
    none, all_ = wilson_interval(0, 50), wilson_interval(50, 50)
    assert (none.low, all_.high) == (0.0, 1.0)
    assert all_.low == pytest.approx(1.0 - none.high)


def test_the_true_ratio_is_inside_about_19_times_of_20():
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(200):
        other = rng.uniform(80.0, 120.0, 50)
        own = 0.5 * other * rng.uniform(0.6, 1.4, 50)
        interval = ratio_interval(own, other)
        inside += interval.low <= 0.5 <= interval.high
    assert 180 <= inside <= 199


def test_one_task_says_nothing_about_others():
    assert ratio_interval([12.0], [24.0]) is None


def test_the_same_trials_give_the_same_interval():
    assert ratio_interval([1, 2, 3], [4, 4, 4]) == ratio_interval([1, 2, 3], [4, 4, 4])


def test_the_interval_of_a_mean_of_few_values_is_students():
    """As scipy.stats.t.interval(0.95, 2, 2.0, 1 / 3 ** 0.5) has it."""
    interval = mean_interval([1.0, 2.0, 3.0])
    assert (interval.low, interval.high) == pytest.approx((-0.4841, 4.4841), abs=1e-3)
    assert mean_interval([1.0]) is None
    halves = [mean_interval([0.0, 1.0] * n).high - 0.5 for n in range(1, 20)]
    assert halves == sorted(halves, reverse=True)  # with any number of values
