# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sampling where things are. Lengths in m."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from slap_ros.domains.variation import TaskSettings
from slap_ros.errors import InvalidParameterError
from slap_ros.worlds.contact.hand_model import HANDS

Range = tuple[float, float]
Spot = tuple[float, float]  # x, y

ANY = -1  # instead of a number
TRIES = 1_000  # arrangements drawn before there is said to be no room
DARTS = 10  # for each thing of an arrangement
BENCH_LIMITS = {
    "x": (0.3, 0.8),  # what the hand reaches
    "y": (-0.5, 0.5),
    "yaw": (-math.pi, math.pi),
}


@dataclass(frozen=True)
class BenchSettings(TaskSettings):
    """What tasks at any bench are made from.

    Args:
        hand: Name of the hand that acts there.
    """

    choices: ClassVar = {"hand": tuple(HANDS)}

    hand: str = field(default="quick", kw_only=True)


def spread_out(
    rng: np.random.Generator, count: int, x: Range, y: Range, apart: float
) -> list[Spot]:
    """Places that are not too near to one another.

    Args:
        rng: Source of random numbers.
        count: Number of places.
        x: Range of the places' x, m.
        y: Range of the places' y, m.
        apart: Least distance between any two places, m.

    Returns:
        One for each.

    Raises:
        InvalidParameterError: There is no room for them.
    """
    for _ in range(TRIES):
        spots: list[Spot] = []
        for _ in range(DARTS * count):
            spot = (float(rng.uniform(*x)), float(rng.uniform(*y)))
            if all(math.dist(spot, other) >= apart for other in spots):
                spots.append(spot)
            if len(spots) == count:
                return spots
    raise InvalidParameterError(
        f"there is no room for {count} things {apart} m apart within x from {x[0]} to {x[1]} m "
        f"and y from {y[0]} to {y[1]} m; give more room or fewer things"
    )


def some_of(rng: np.random.Generator, total: int, count: int, first: int = ANY) -> list[int]:
    """Numbers from 0 up to a total, drawn at random.

    Args:
        rng: Source of random numbers.
        total: Numbers to choose from: 0 up to, but not including, this one.
        count: Number of numbers wanted.
        first: The one that is surely among them, and comes first; :data:`ANY` for none.

    Returns:
        Different ones, in random order.
    """
    numbers = [int(number) for number in rng.permutation(total)]
    if first != ANY:
        numbers.remove(first)
        numbers.insert(0, first)
    return numbers[:count]
