# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Placements: where on a level rectangle something can be put down. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import islice

GAP = 0.1  # between the middles of things that stand apart at least, so that fingers fit between
SPACING = 0.05  # of the grid of places
MAX_PLACEMENTS = 40  # tried in order of distance

Placement = tuple[float, float]  # x, y


def free_placements(
    near: Placement,
    middle: Placement,
    half: Placement,
    taken: Iterable[tuple[Placement, float]],
    spacing: float = SPACING,
) -> list[Placement]:
    """The free places of a grid, the nearest first.

    Args:
        near: Place that the free places are to be near to: x, y in m.
        middle: Middle of the rectangle, which is a place of the grid: x, y in m.
        half: Half the edges of the rectangle that the places are in, m.
        taken: Middles of what stands there, each with the least distance of a place from it, m.
        spacing: Distance between neighbouring places of the grid, m.

    Returns:
        At most MAX_PLACEMENTS, nearest first.
    """
    (x, y), standing = near, list(taken)
    columns, rows = (_grid(middle[axis], half[axis], spacing) for axis in range(2))
    places = [(px, py) for px in columns for py in rows]
    nearest_first = sorted([(math.hypot(px - x, py - y), (px, py)) for px, py in places])
    free = (
        (px, py)
        for _, (px, py) in nearest_first
        if all(math.hypot(px - tx, py - ty) >= gap for (tx, ty), gap in standing)
    )
    return list(islice(free, MAX_PLACEMENTS))


def _grid(middle: float, half: float, spacing: float) -> list[float]:
    count = math.floor(half / spacing)
    return [middle + i * spacing for i in range(-count, count + 1)]
