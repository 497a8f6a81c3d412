# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions that give the same bits on every processor.

numpy's own ``exp`` and ``tanh`` do not: numpy chooses an implementation for the processor, and the
last bit differs. Here they are made of sums, products, quotients and roundings alone, which
IEEE 754 defines to the bit. Values that a library computed still differ in their last bits.
Rounding them to a grid (:func:`on_grid`) hides that.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Float = TypeVar("Float", np.float32, np.float64)

# In rad, m, or parts of an action's range. Four micrometres are far below what a robot's joints
# repeat. A power of two, so that products and quotients with it are exact.
RESOLUTION = 2.0**-18
LN_2 = 0.6931471805599453
LOG2_E = 1.4426950408889634
LARGEST_EXPONENT = 700.0  # exp of it is still finite
# Taylor coefficients of exp from x^9 down: below ln(2) / 2 the rest is less than 1e-11.
EXP_COEFFICIENTS = tuple(1.0 / math.factorial(power) for power in range(9, -1, -1))
SATURATED = 20.0  # where tanh differs from 1 by 1e-17


def on_grid(values: NDArray[Float]) -> NDArray[Float]:
    """Values rounded to the nearest multiple of ``RESOLUTION``, of the same shape and type.

    Values that differ in their last bits become equal, except where an odd multiple of half the
    resolution lies between them: about one pair in 10^10 of 64-bit values near 1. Zero has no sign.
    """
    rounded: NDArray[Float] = np.rint(values / RESOLUTION) * RESOLUTION + 0.0
    return rounded.astype(values.dtype, copy=False)


def exp(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The exponential function, to a relative error of 1e-11.

    It is 2^k exp(r) with |r| ≤ ln(2) / 2, where exp(r) is a Taylor polynomial.

    Args:
        values: Exponents of any shape, none of them NaN; beyond ±700 they count as ±700.
    """
    limited = np.clip(values, -LARGEST_EXPONENT, LARGEST_EXPONENT)
    k = np.rint(limited * LOG2_E)
    r = limited - k * LN_2
    polynomial = np.full_like(r, EXP_COEFFICIENTS[0])
    for coefficient in EXP_COEFFICIENTS[1:]:
        polynomial *= r
        polynomial += coefficient
    result: NDArray[np.float64] = np.ldexp(polynomial, k.astype(np.int32))
    return result


def tanh(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The hyperbolic tangent, to an absolute error of 1e-11; NaN where a value is NaN.

    Args:
        values: Numbers of any shape.
    """
    size = np.minimum(np.abs(values), SATURATED)
    shrunk = exp(np.where(np.isnan(size), 0.0, -2.0 * size))
    return np.copysign((1.0 - shrunk) / (1.0 + shrunk), values) + 0.0 * size
