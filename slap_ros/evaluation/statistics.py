# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The uncertainty of figures: intervals that hold the true value with 95 % confidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, stdev

import numpy as np

NORMAL_95 = 1.959963984540054  # within so many standard deviations are 95 % of a normal variable
# The same of Student's t, from 1 degree of freedom on.
STUDENT_95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)
RESAMPLES = 10_000
SEED = 95  # seed of the resampling: the same trials give the same interval


@dataclass(frozen=True)
class Interval:
    """An interval: the lower and the upper bound."""

    low: float
    high: float


@dataclass(frozen=True)
class SuccessRate:
    """How many of some trials succeeded.

    Args:
        successes: Number of trials that succeeded.
        trials: Number of trials, at least 1.
    """

    successes: int
    trials: int

    @property
    def share(self) -> float:
        """Share of trials that succeeded, between 0 and 1."""
        return self.successes / self.trials

    @property
    def interval(self) -> Interval:
        """Wilson's 95 % interval of the share."""
        return wilson_interval(self.successes, self.trials)

    def __str__(self) -> str:
        return f"{self.share:.0%} [{self.interval.low:.0%}, {self.interval.high:.0%}]"


def wilson_interval(successes: int, trials: int) -> Interval:
    """Wilson's 95 % score interval of a success rate.

    Args:
        successes: Number of trials that succeeded.
        trials: Number of trials, at least 1.

    Returns:
        Bounds in [0, 1].
    """
    z2 = NORMAL_95**2
    rate = successes / trials
    middle = (rate + z2 / (2 * trials)) / (1 + z2 / trials)
    spread = math.sqrt(rate * (1 - rate) / trials + z2 / (4 * trials**2))
    half = NORMAL_95 * spread / (1 + z2 / trials)
    # With no failure, or nothing else, the bound is exact; rounding must not move it.
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == trials else middle + half
    return Interval(low, high)


def mean_interval(values: Sequence[float]) -> Interval | None:
    """Student's 95 % interval of the mean of few values, such as those of several seeds.

    Args:
        values: Values. With more than 13 of them, the interval is the normal distribution's, which
            is narrower by a tenth at most.

    Returns:
        The interval; None with fewer than two values.
    """
    if len(values) < 2:
        return None
    freedom = len(values) - 1
    quantile = STUDENT_95[freedom - 1] if freedom <= len(STUDENT_95) else NORMAL_95
    half = quantile * stdev(values) / math.sqrt(len(values))
    return Interval(fmean(values) - half, fmean(values) + half)


def ratio_interval(numerators: Sequence[float], denominators: Sequence[float]) -> Interval | None:
    """The bootstrap's 95 % interval of a ratio of two sums over the same tasks.

    Args:
        numerators: Numerator of each task.
        denominators: Denominator of each task, above 0.

    Returns:
        The 2.5th and 97.5th percentile over resampled tasks; None with fewer than two tasks.
    """
    own, other = np.array(numerators, dtype=float), np.array(denominators, dtype=float)
    if len(own) < 2:
        return None
    drawn = np.random.default_rng(SEED).integers(0, len(own), (RESAMPLES, len(own)))
    low, high = np.percentile(own[drawn].sum(axis=1) / other[drawn].sum(axis=1), (2.5, 97.5))
    return Interval(float(low), float(high))
