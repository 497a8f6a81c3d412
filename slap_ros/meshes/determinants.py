# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Determinants whose bits do not depend on the processor, as those of numpy's do.

numpy leaves them to OpenBLAS, which has kernels of its own for AVX-512. Where a toy's inertia then
differs in its last bit, contact amplifies that, and plans differ. Here they are computed as LAPACK
does without fused operations, column by column with partial pivoting, and multiplied as numpy does,
by their logarithms. So the bits are those of numpy on most processors, which made our figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def determinants(matrices: Array) -> Array:
    """The determinants of matrices, shape (..., n, n) to (...)."""
    size = matrices.shape[-1]
    found = [_determinant(matrix) for matrix in matrices.reshape(-1, size, size).tolist()]
    return np.array(found).reshape(matrices.shape[:-2])


def _determinant(rows: list[list[float]]) -> float:
    """The determinant of a matrix, which is overwritten by its factors."""
    sign = 1.0
    for column in range(len(rows)):
        for row in range(1, len(rows)):
            done = range(min(row, column))
            rows[row][column] -= _sum([rows[row][k] * rows[k][column] for k in done])
        pivot = max(range(column, len(rows)), key=lambda row: abs(rows[row][column]))
        if pivot != column:
            rows[column], rows[pivot] = rows[pivot], rows[column]
            sign = -sign
        if rows[column][column] == 0.0:
            return 0.0
        factor = 1.0 / rows[column][column]
        for row in range(column + 1, len(rows)):
            rows[row][column] *= factor
    diagonal = [rows[k][k] for k in range(len(rows))]
    sign *= math.prod(math.copysign(1.0, one) for one in diagonal)
    return sign * math.exp(_sum([math.log(abs(one)) for one in diagonal]))


def _sum(values: Sequence[float]) -> float:
    """A sum from the first to the last; ``sum`` adds more exactly from Python 3.12 on."""
    total = 0.0
    for value in values:
        total += value
    return total
