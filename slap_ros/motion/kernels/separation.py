# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether two boxes keep a distance, as :mod:`slap_ros.geometry.box_separation`."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import inner
from slap_ros.geometry.box_separation import NEARLY_PARALLEL, PROJECTIONS, TOUCHING
from slap_ros.geometry.pose import Vector
from slap_ros.motion.kernels.vectors import (
    Matrix,
    absolute,
    applied,
    difference,
    dot,
    total,
    transposed,
)


@inner
def separated(
    turn: Matrix, offset: Vector, half_a: Vector, half_b: Vector, distance: float
) -> bool:
    """Whether box A is at least so far from box B. Never True wrongly.

    Args:
        turn: Orientation of B seen from A.
        offset: Centre of A seen from B, m.
        half_a: Half the edges of A, m.
        half_b: Half the edges of B, m.
        distance: Least distance, m; below 0, how deep they may overlap.
    """
    offset_a = applied(turn, offset)  # the same vector along the axes of A
    if _gap_along_edges(turn, offset, offset_a, half_a, half_b) >= distance:
        return True
    gap, length = _gap_between_nearest_points(turn, offset, offset_a, half_a, half_b)
    if gap >= distance or length < distance:
        return bool(gap >= distance)
    return _gap_across_edges(turn, offset_a, half_a, half_b) >= distance


@inner
def _gap_along_edges(
    turn: Matrix, offset: Vector, offset_a: Vector, half_a: Vector, half_b: Vector
) -> float:
    most, back = -np.inf, transposed(turn)
    for i in range(3):
        shadow_b = dot(absolute(turn[i]), half_b)
        shadow_a = dot(absolute(back[i]), half_a)
        along_a = abs(offset_a[i]) - half_a[i] - shadow_b
        along_b = abs(offset[i]) - half_b[i] - shadow_a
        most = max(most, along_a, along_b)
    return most


@inner
def _clipped(point: Vector, half: Vector) -> Vector:
    """The point of a box that is nearest to a point."""
    return (
        max(min(point[0], half[0]), -half[0]),
        max(min(point[1], half[1]), -half[1]),
        max(min(point[2], half[2]), -half[2]),
    )


@inner
def _gap_between_nearest_points(
    turn: Matrix, offset: Vector, offset_a: Vector, half_a: Vector, half_b: Vector
) -> tuple[float, float]:
    back = transposed(turn)
    in_b, point_a, point_b = offset, offset, offset
    for _ in range(PROJECTIONS):
        point_b = applied(turn, difference(_clipped(in_b, half_b), offset))
        point_a = _clipped(point_b, half_a)
        in_b = total(applied(back, point_a), offset)
    line = difference(point_b, point_a)
    length = math.sqrt(dot(line, line))
    if length < TOUCHING:
        return -np.inf, length
    reach = dot(absolute(line), half_a) + dot(absolute(applied(back, line)), half_b)
    return (abs(dot(line, offset_a)) - reach) / length, length


@inner
def _gap_across_edges(turn: Matrix, offset_a: Vector, half_a: Vector, half_b: Vector) -> float:
    most, size = -np.inf, (absolute(turn[0]), absolute(turn[1]), absolute(turn[2]))
    for i in range(3):
        after_i, last_i = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            after_j, last_j = (j + 1) % 3, (j + 2) % 3
            sine2 = 1.0 - size[i][j] * size[i][j]
            if sine2 < NEARLY_PARALLEL * NEARLY_PARALLEL:
                continue
            shift = offset_a[last_i] * turn[after_i][j] - offset_a[after_i] * turn[last_i][j]
            reach_a = half_a[after_i] * size[last_i][j] + half_a[last_i] * size[after_i][j]
            reach_b = half_b[after_j] * size[i][last_j] + half_b[last_j] * size[i][after_j]
            most = max(most, (abs(shift) - reach_a - reach_b) / math.sqrt(sine2))
    return most
