# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Footprints of many boxes at once: where their edges point, how wide they are from above.

Horizontal vectors are complex numbers: turned by a product, seen along both axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from slap_ros.relational.state import Array

STEEPNESS = 50.0  # 1, of tolerances in margins: 4 mm count as 20 cm sideways

Complex = NDArray[np.complex128]
Indices = NDArray[np.intp]
PARTS = ("qw", "qz", "qx", "qy")  # as they are read: (w, z) and (x, y) turn the plane
W, Z, X, Y = range(4)


def _to_edges() -> Array:
    """The linear map from the products of a quaternion's parts to where a unit cube's edges point.

    Returns:
        Shape (16, 9): x and y of the first, second and third edge, then z of each.
    """
    to = np.zeros((4, 4, 9))
    axes, place = (X, Y, Z), ((0, 2, 4), (1, 3, 5), (6, 7, 8))  # place[coordinate][edge]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        a, b, c = axes[i], axes[j], axes[k]
        to[[a, W, b, c], [a, W, b, c], place[i][i]] = 1.0, 1.0, -1.0, -1.0
        to[a, b, place[i][j]], to[c, W, place[i][j]] = 2.0, -2.0
        to[a, c, place[i][k]], to[b, W, place[i][k]] = 2.0, 2.0
    return to.reshape(16, 9)


@dataclass(frozen=True)
class OrderedSums:
    """A linear map with few terms a sum, added up one after the other.

    A product of matrices adds up in the order of the processor's own library, or rounds once for
    two operations, so that last bits differ from one processor to another.

    Args:
        terms: Which of the inputs each sum has, shape (most terms, outputs).
        factors: What these are multiplied by, 0 where a sum has fewer terms, of the same shape.
    """

    terms: Indices
    factors: Array

    @classmethod
    def of(cls, matrix: Array) -> Self:
        """The map of a matrix, shape (inputs, outputs)."""
        most = int(np.count_nonzero(matrix, axis=0).max())
        terms = np.argsort(matrix == 0.0, axis=0, kind="stable")[:most]
        return cls(terms, np.take_along_axis(matrix, terms, axis=0))

    def __call__(self, inputs: Array) -> Array:
        """The sums, shape (..., outputs), of inputs of shape (..., inputs)."""
        sums: Array = np.add.reduce(inputs.take(self.terms, axis=-1) * self.factors, axis=-2)
        return sums


def products_of_parts(q: Array) -> Array:
    """All products of two parts of quaternions: shape (..., 16), of parts of shape (..., 4)."""
    return (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)


TO_EDGES = _to_edges()
_EDGES = OrderedSums.of(TO_EDGES)
HALVES = (*("half_x",) * 2, *("half_y",) * 2, *("half_z",) * 2, "half_x", "half_y", "half_z")


def unit_edges(q: Array) -> Array:
    """Where the edges of unit cubes point, as ``TO_EDGES`` orders them.

    Args:
        q: Parts of their quaternions, shape (..., cubes, 4), as ``PARTS`` orders them.

    Returns:
        Shape (..., cubes, 9).
    """
    return _EDGES(products_of_parts(q))


def complex_of(pairs: Array) -> Complex:
    """Numbers from their parts side by side, without copying."""
    numbers: Complex = pairs.view(np.complex128)
    return numbers


def turned(vectors: Complex, turns: Complex) -> Complex:
    """The products, rounded as IEEE 754 says: numpy's own may be fused, where a processor can."""
    x, y, cos, sin = vectors.real, vectors.imag, turns.real, turns.imag
    along, aside = x * cos - y * sin, x * sin + y * cos
    return complex_of(np.stack([along, aside], axis=-1))[..., 0]


def along_axes(vectors: Complex) -> Array:
    """How far vectors reach along the axes, shape (..., 2)."""
    return np.abs(vectors[..., None].view(np.float64))


def inverse_yaws(q: Array, edges: Array) -> Complex:
    """What turns the plane so that things lie along its axes, by their yaw.

    Of the two parts of a quaternion that have to do with the yaw, one is 0 for what lies on its
    bottom, the other for what lies on its head. The larger one is taken.
    """
    parts = complex_of(q)
    part: Complex = np.where(edges[..., 8] > 0.0, parts[..., 0], parts[..., 1])
    back: Complex = part.conj() / part
    return back


def half_widths(edges: Complex, back: Complex) -> Array:
    """How far boxes reach from their centres along turned axes, shape (..., 2)."""
    along = along_axes(turned(edges, back[..., None]))
    width: Array = along[..., 0, :] + along[..., 1, :] + along[..., 2, :]
    return width


def steepened(tolerance: Array) -> Array:
    """A tolerance that, where it is kept, leaves a smallest margin to the distances sideways."""
    return np.maximum(tolerance, STEEPNESS * tolerance)
