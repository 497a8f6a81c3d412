# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether many pairs of oriented boxes keep a distance from each other.

Sums are written out: libraries sum in another order, or without rounding in between, as the
processor does it best, and the last bit differs.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]  # the other two axes of each axis
NEARLY_PARALLEL = 1e-3  # least sine of the angle between two edges that is told from 0
TOUCHING = 1e-9  # m, below which two points are one
PROJECTIONS = 3  # from box to box, in search of their nearest points


def separated(turn: Array, offset: Array, half_a: Array, half_b: Array, distance: Array) -> Flags:
    """Whether boxes A are at least so far from boxes B. Never True wrongly.

    Looks for a line on which the boxes' shadows are that far apart: among the 15 lines that decide
    whether two boxes touch, and the line through their (nearly) nearest points.

    Args:
        turn: Orientation of B seen from A, shape (m, 3, 3).
        offset: Centre of A seen from B, m, shape (m, 3).
        half_a: Half the edges of A, m, shape (m, 3).
        half_b: Half the edges of B, m, shape (m, 3).
        distance: Least distance between the boxes, m, shape (m,); below 0, how deep they may
            overlap.

    Returns:
        Shape (m,).
    """
    found = _gaps_along_edges(turn, offset, half_a, half_b) >= distance
    if found.all():
        return found
    rest = (~found).nonzero()[0]
    pairs = turn[rest], offset[rest], half_a[rest], half_b[rest]
    gap, length = _gaps_between_nearest_points(*pairs)
    found[rest] = gap >= distance[rest]
    # Two points of theirs that are too close settle it as well; hardly any pair is left over.
    rest = rest[(gap < distance[rest]) & (length >= distance[rest])]
    if len(rest):
        pairs = turn[rest], offset[rest], half_a[rest], half_b[rest]
        found[rest] = _gaps_across_edges(*pairs) >= distance[rest]
    return found


def _gaps_along_edges(turn: Array, offset: Array, half_a: Array, half_b: Array) -> Array:
    """The largest gap along the edges of A and of B."""
    size = np.abs(turn)
    along_a = np.abs(_apply(turn, offset)) - half_a - _apply(size, half_b)
    along_b = np.abs(offset) - half_b - _apply(size.swapaxes(1, 2), half_a)
    return cast(Array, np.maximum(along_a, along_b).max(-1))


def _gaps_across_edges(turn: Array, offset: Array, half_a: Array, half_b: Array) -> Array:
    """The largest gap along the cross products of the edges of A and of B."""
    size = np.abs(turn)
    offset_a = _apply(turn, offset)  # the same vector along the axes of A
    shift = offset_a[:, _AFTER, None] * turn[:, _NEXT] - offset_a[:, _NEXT, None] * turn[:, _AFTER]
    reach_a = half_a[:, _NEXT, None] * size[:, _AFTER] + half_a[:, _AFTER, None] * size[:, _NEXT]
    wide, deep = half_b[:, None, _NEXT], half_b[:, None, _AFTER]
    reach_b = wide * size[:, :, _AFTER] + deep * size[:, :, _NEXT]
    sine2 = 1.0 - size * size
    parallel = sine2 < NEARLY_PARALLEL**2  # then there is no such line
    gap = (np.abs(shift) - reach_a - reach_b) / np.sqrt(np.where(parallel, 1.0, sine2))
    return cast(Array, np.where(parallel, -np.inf, gap).max((1, 2)))


def _gaps_between_nearest_points(
    turn: Array, offset: Array, half_a: Array, half_b: Array
) -> tuple[Array, Array]:
    """The gap along the line through a point of A and one of B, and how far apart these are.

    Each is projected onto the other's box in turn: in the limit they are the nearest.
    """
    back = turn.swapaxes(1, 2)
    in_b = offset  # the centre of A
    for _ in range(PROJECTIONS):
        point_b = np.maximum(np.minimum(in_b, half_b), -half_b) - offset
        point_b = _apply(turn, point_b)  # seen from A
        point_a = np.maximum(np.minimum(point_b, half_a), -half_a)
        in_b = _apply(back, point_a) + offset
    line = point_b - point_a
    reach = dot(np.abs(line), half_a) + dot(np.abs(_apply(back, line)), half_b)
    shadow = np.abs(dot(line, _apply(turn, offset)))
    length = np.sqrt(dot(line, line))
    touching = length < TOUCHING
    gap = np.where(touching, -np.inf, (shadow - reach) / np.where(touching, 1.0, length))
    return gap, length


def dot(a: Array, b: Array) -> Array:
    """The inner products of vectors: shapes (..., 3) to (...)."""
    product: Array = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _apply(matrices: Array, vectors: Array) -> Array:
    return dot(matrices, vectors[..., None, :])
