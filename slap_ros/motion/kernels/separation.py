# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether two boxes keep a distance, as :mod:`slap_ros.geometry.box_separation`."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import inner
from slap_ros.geometry.box_separation import NEARLY_PARALLEL, PROJECTIONS, TOUCHING, Array


@inner
def dot(a: Array, b: Array) -> float:
    """The inner product of two vectors, shape (3,)."""
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@inner
def separated(turn: Array, offset: Array, half_a: Array, half_b: Array, distance: float) -> bool:
    """Whether box A is at least so far from box B. Never True wrongly.

    Args:
        turn: Orientation of B seen from A, shape (3, 3).
        offset: Centre of A seen from B, m, shape (3,).
        half_a: Half the edges of A, m, shape (3,).
        half_b: Half the edges of B, m, shape (3,).
        distance: Least distance, m; below 0, how deep they may overlap.
    """
    offset_a = np.empty(3)  # the same vector along the axes of A
    for i in range(3):
        offset_a[i] = dot(turn[i], offset)
    if _gap_along_edges(turn, offset, offset_a, half_a, half_b) >= distance:
        return True
    gap, length = _gap_between_nearest_points(turn, offset, offset_a, half_a, half_b)
    if gap >= distance or length < distance:
        return bool(gap >= distance)
    return _gap_across_edges(turn, offset_a, half_a, half_b) >= distance


@inner
def _gap_along_edges(
    turn: Array, offset: Array, offset_a: Array, half_a: Array, half_b: Array
) -> float:
    most = -np.inf
    for i in range(3):
        shadow_b = (
            abs(turn[i, 0]) * half_b[0] + abs(turn[i, 1]) * half_b[1] + abs(turn[i, 2]) * half_b[2]
        )
        shadow_a = (
            abs(turn[0, i]) * half_a[0] + abs(turn[1, i]) * half_a[1] + abs(turn[2, i]) * half_a[2]
        )
        along_a = abs(offset_a[i]) - half_a[i] - shadow_b
        along_b = abs(offset[i]) - half_b[i] - shadow_a
        most = max(most, along_a, along_b)
    return most


@inner
def _gap_between_nearest_points(
    turn: Array, offset: Array, offset_a: Array, half_a: Array, half_b: Array
) -> tuple[float, float]:
    in_b, from_b, point_a, point_b = offset.copy(), np.empty(3), np.empty(3), np.empty(3)
    for _ in range(PROJECTIONS):
        for i in range(3):
            from_b[i] = max(min(in_b[i], half_b[i]), -half_b[i]) - offset[i]
        for i in range(3):
            point_b[i] = dot(turn[i], from_b)
            point_a[i] = max(min(point_b[i], half_a[i]), -half_a[i])
        for i in range(3):
            in_b[i] = dot(turn[:, i], point_a) + offset[i]
    line = point_b - point_a
    length = math.sqrt(dot(line, line))
    if length < TOUCHING:
        return -np.inf, length
    shadow_a = abs(line[0]) * half_a[0] + abs(line[1]) * half_a[1] + abs(line[2]) * half_a[2]
    across = np.empty(3)
    for i in range(3):
        across[i] = abs(dot(turn[:, i], line))
    reach = shadow_a + dot(across, half_b)
    return (abs(dot(line, offset_a)) - reach) / length, length


@inner
def _gap_across_edges(turn: Array, offset_a: Array, half_a: Array, half_b: Array) -> float:
    most = -np.inf
    for i in range(3):
        after_i, last_i = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            after_j, last_j = (j + 1) % 3, (j + 2) % 3
            sine2 = 1.0 - abs(turn[i, j]) * abs(turn[i, j])
            if sine2 < NEARLY_PARALLEL * NEARLY_PARALLEL:
                continue
            shift = offset_a[last_i] * turn[after_i, j] - offset_a[after_i] * turn[last_i, j]
            reach_a = half_a[after_i] * abs(turn[last_i, j]) + half_a[last_i] * abs(
                turn[after_i, j]
            )
            reach_b = half_b[after_j] * abs(turn[i, last_j]) + half_b[last_j] * abs(
                turn[i, after_j]
            )
            most = max(most, (abs(shift) - reach_a - reach_b) / math.sqrt(sine2))
    return most
