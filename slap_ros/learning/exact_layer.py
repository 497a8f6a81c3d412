# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linear layers whose sums are exact, so that their order does not matter.

A BLAS library chooses in which order it sums up a matrix product: by the processor, the number of
threads, and the number of rows. In floating point, another order gives another last bit. Here
inputs are multiples of :data:`~slap_ros.portable_math.RESOLUTION`, and weights are
multiples of a power of two as well. Both are so coarse that every partial sum fits in the 53 bits
of a float. Nothing is rounded, in any order, with fused multiply-add or without.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.portable_math import RESOLUTION

MANTISSA_BITS = 53  # of a 64-bit float


@dataclass(frozen=True, eq=False)
class ExactLayer:
    """A linear map of rows, ``inputs @ weights + bias``, without rounding.

    Args:
        weights: Shape (in, out).
        bias: Shape (out,).
        bound: Largest magnitude that an output can have.
    """

    weights: NDArray[np.float64]
    bias: NDArray[np.float64]
    bound: float

    @classmethod
    def of(
        cls, weights: NDArray[np.float32], bias: NDArray[np.float32], input_bound: float
    ) -> ExactLayer:
        """Round the weights as little as exact sums allow.

        Args:
            weights: Shape (out, in), finite.
            bias: Shape (out,), finite.
            input_bound: Largest magnitude of an input.
        """
        rows = np.abs(weights.astype(np.float64)).tolist()
        limits = np.abs(bias.astype(np.float64)).tolist()
        bound = max(
            input_bound * math.fsum(row) + limit for row, limit in zip(rows, limits, strict=True)
        )
        # Twice the bound leaves room for weights that are rounded up.
        _, exponent = math.frexp(2.0 * bound + RESOLUTION)
        product_step = math.ldexp(1.0, exponent - MANTISSA_BITS)
        return cls(
            _rounded(weights.T, product_step / RESOLUTION), _rounded(bias, product_step), bound
        )

    def __call__(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs of the layer, shape (n, out).

        Args:
            inputs: Multiples of ``RESOLUTION`` within the bound, shape (n, in).
        """
        outputs: NDArray[np.float64] = inputs @ self.weights + self.bias
        return outputs


def _rounded(values: NDArray[np.float32], step: float) -> NDArray[np.float64]:
    """The nearest multiples of a power of two."""
    return np.ascontiguousarray(np.rint(values.astype(np.float64) / step) * step)
