# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a layer's sums before the next layer: activated, and rounded to the grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from slap_ros.portable_math import on_grid, tanh, tanh_on_grid
from slap_ros.tiered_function import TieredFunction

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


def _compiled_tanh() -> OfSums:
    from slap_ros.policies import kernels

    return kernels.tanh_of_sums


def _relu(values: Values) -> Values:
    return np.maximum(values, 0.0)


TANH_OF_SUMS: TieredFunction[OfSums] = TieredFunction(tanh_of_sums, _compiled_tanh)
# Each rises with its argument, so that the largest argument gives the largest result.
ACTIVATIONS: Mapping[str, Callable[[Values], Values]] = {"tanh": tanh, "relu": _relu}
# The same of sums, rounded to the grid.
OF_SUMS: Mapping[str, OfSums] = {
    "tanh": lambda sums, bias: TANH_OF_SUMS.of(len(sums))(sums, bias),
    "relu": lambda sums, bias: on_grid(_relu(outputs_of_sums(sums, bias))),
}
