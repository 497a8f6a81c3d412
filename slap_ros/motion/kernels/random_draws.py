# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random numbers for compiled code, from numpy's generator in the order in which numpy has them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from slap_ros.motion.joints import Array

T = TypeVar("T")


def with_draws(
    rng: np.random.Generator, shape: tuple[int, int], use: Callable[[Array], tuple[T, int]]
) -> T:
    """What a function makes of rows of random numbers; the generator gives only those it used.

    Args:
        rng: Source of the random numbers.
        shape: Rows that may be used, and random numbers in each.
        use: Function of numbers from 0 to 1 that returns a result, and how many rows it used.
    """
    before = rng.bit_generator.state
    result, used = use(rng.random(shape))
    if used < shape[0]:
        rng.bit_generator.state = before
        rng.random((used, shape[1]))
    return result
