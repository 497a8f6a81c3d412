# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A layer's activation as compiled code: all of it in two passes over the sums."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.portable_math import (
    EXP_COEFFICIENTS,
    EXPONENT_BIAS,
    LN_2,
    LOG2_E,
    MANTISSA_BITS,
    PER_UNIT,
    RESOLUTION,
    SATURATED,
)

Values = NDArray[np.float64]


@compiled
def tanh_of_sums(sums: Values, bias: Values) -> Values:
    """See :func:`slap_ros.policies.activation.tanh_of_sums`, which has the same bits."""
    rows, size = len(sums), len(bias)
    values, powers = np.empty((rows, size)), np.empty((rows, size), np.int64)
    for i in range(rows):
        for j in range(size):
            value = (sums[i, j] + sums[i, size + j]) + bias[j]
            values[i, j] = value
            power = np.int64(np.rint(_exponent(value) * LOG2_E))
            powers[i, j] = (power + EXPONENT_BIAS) << MANTISSA_BITS
    scales = powers.view(np.float64)  # powers of two
    for i in range(rows):
        for j in range(size):
            values[i, j] = _tanh_on_grid(values[i, j], scales[i, j])
    return values


@inner
def _exponent(value: float) -> float:
    """Of which exponential function the tangent is made."""
    size = abs(value)
    return -2.0 * (size if size < SATURATED else SATURATED)


@inner
def _tanh_on_grid(value: float, scale: float) -> float:
    """``on_grid(tanh(value))``, where the scale is the power of two nearest to its exponential."""
    exponent = _exponent(value)
    rest = exponent - np.rint(exponent * LOG2_E) * LN_2
    shrunk = EXP_COEFFICIENTS[0]
    for coefficient in EXP_COEFFICIENTS[1:]:
        shrunk = shrunk * rest + coefficient
    shrunk *= scale
    tanh = math.copysign((1.0 - shrunk) / (1.0 + shrunk), value)
    rounded = np.rint(tanh * PER_UNIT) * RESOLUTION + 0.0
    return rounded if value == value else value
