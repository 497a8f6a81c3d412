# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a layer's sums before the next layer: activated, and rounded to the grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from slap_ros.portable_math import on_grid, tanh, tanh_on_grid

Values = NDArray[np.float64]
# From sums of both parts of a layer, side by side, shape (n, 2 * size), and its bias, shape
# (size,), to inputs of the next layer, shape (n, size).
OfSums = Callable[[Values, Values], Values]


def outputs_of_sums(sums: Values, bias: Values) -> Values:
    """The outputs of a linear layer, shape (n, size); see :data:`OfSums`."""
    outputs: Values = sums[:, : len(bias)] + sums[:, len(bias) :]
    outputs += bias
    return outputs


def tanh_of_sums(sums: Values, bias: Values) -> Values:
    """The hyperbolic tangent of these outputs, rounded to the grid; see :data:`OfSums`."""
    return tanh_on_grid(outputs_of_sums(sums, bias))


@cache
def _fastest_tanh() -> OfSums:
    """Compiled code where numba can be imported, else numpy: the same to the bit."""
    try:
        from slap_ros.policies.kernels import tanh_of_sums as compiled_tanh
    except ImportError:
        return tanh_of_sums
    return compiled_tanh


def _relu(values: Values) -> Values:
    return np.maximum(values, 0.0)


# Each rises with its argument, so that the largest argument gives the largest result.
ACTIVATIONS: Mapping[str, Callable[[Values], Values]] = {"tanh": tanh, "relu": _relu}
# The same of sums, rounded to the grid.
OF_SUMS: Mapping[str, OfSums] = {
    "tanh": lambda sums, bias: _fastest_tanh()(sums, bias),
    "relu": lambda sums, bias: on_grid(_relu(outputs_of_sums(sums, bias))),
}
