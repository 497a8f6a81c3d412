# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linear layers whose sums are exact, so that their order does not matter.

A BLAS library chooses in which order it sums up a matrix product: by the processor, the number of
threads, and the number of rows. In floating point, another order gives another last bit. Here
inputs are multiples of :data:`~slap_ros.portable_math.RESOLUTION`, and weights are the sum of two
parts, each of which has multiples of a power of two alone. Both powers are so large that every
partial sum fits in the 53 bits of a float. Nothing in a product with a part is rounded, in any
order, with fused multiply-add or without.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slap_ros.policies.activation import outputs_of_sums
from slap_ros.portable_math import RESOLUTION

Values = NDArray[np.float64]
MANTISSA_BITS = 53  # bits of a 64-bit float's mantissa
# Largest product, in multiplications, that OpenBLAS leaves to one thread. Threads wait for one
# another where cores are busy: there, 64 rows took up to a hundred times as long as twice 32 rows.
LARGEST_PRODUCT = 2**18
MAX_ROWS = 64  # of a product
LEAST_ROWS = 16  # fewer take longer than threads do
PARTS = 2  # parts of the weights: with two, the sums are as good as those of 64-bit floats


@dataclass(frozen=True, eq=False)
class ExactLayer:
    """A linear map of rows, ``inputs @ weights + bias``, the same in any order of summation.

    Args:
        parts: Parts of the weights, the coarse one first, each of shape (in, out).
        bias: Bias of each output, shape (out,).
        bound: Largest magnitude that an output can have.
    """

    parts: tuple[Values, ...]
    bias: Values
    bound: float

    @classmethod
    def of(
        cls, weights: NDArray[np.float32], bias: NDArray[np.float32], input_bound: float
    ) -> ExactLayer:
        """Split weights into parts whose sums are exact.

        Args:
            weights: Weights, shape (out, in), finite.
            bias: Bias of each output, shape (out,), finite.
            input_bound: Largest magnitude of an input.

        Returns:
            The layer.
        """
        rest, offsets = weights.T.astype(np.float64), bias.astype(np.float64)
        bound = input_bound * _largest_sum(rest) + float(np.abs(offsets).max())
        parts = []
        for _ in range(PARTS):
            parts.append(_coarsened(rest, input_bound * _largest_sum(rest)))
            rest = rest - parts[-1]
        return cls(tuple(parts), offsets, bound)

    def __call__(self, inputs: Values) -> Values:
        """Outputs of the layer, shape (n, out).

        Args:
            inputs: Inputs, multiples of ``RESOLUTION`` within the bound, shape (n, in).
        """
        return outputs_of_sums(self.sums(inputs), self.bias)

    def sums(self, inputs: Values) -> Values:
        """Products of inputs with both parts, side by side, shape (n, 2 * out).

        Args:
            inputs: Inputs, multiples of ``RESOLUTION`` within the bound, shape (n, in).
        """
        sums, rows = np.empty((len(inputs), 2 * len(self.bias))), self._rows
        for i in range(0, len(inputs), rows):
            np.matmul(inputs[i : i + rows], self._side_by_side, out=sums[i : i + rows])
        return sums

    @cached_property
    def _rows(self) -> int:
        """Number of rows of a product: as many as one thread multiplies, where those are enough."""
        rows = min(MAX_ROWS, LARGEST_PRODUCT // self._side_by_side.size)
        return rows if rows >= LEAST_ROWS else MAX_ROWS

    @cached_property
    def _side_by_side(self) -> Values:
        """Both parts in one matrix: one product takes less time than two."""
        return np.concatenate(self.parts, axis=1)


def _largest_sum(weights: Values) -> float:
    """Largest sum of magnitudes of the weights of an output, from shape (in, out)."""
    return max(math.fsum(column) for column in np.abs(weights.T).tolist())


def _coarsened(weights: Values, bound: float) -> Values:
    """The nearest weights whose sums are exact.

    Args:
        weights: Weights, shape (in, out).
        bound: Largest magnitude of a sum of products with inputs.
    """
    _, exponent = math.frexp(2.0 * bound)  # twice, as weights may be rounded up
    step = math.ldexp(1.0 / RESOLUTION, exponent - MANTISSA_BITS)
    return np.ascontiguousarray(np.rint(weights / step) * step)
