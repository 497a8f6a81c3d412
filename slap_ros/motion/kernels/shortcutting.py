# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shorter paths, as :mod:`slap_ros.motion.shortcutting`."""

from __future__ import annotations

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Array, Joints, Path
from slap_ros.motion.kernels.lines import control_steps, is_line_free
from slap_ros.motion.shortcutting import GAIN
from slap_ros.worlds.panda import JOINTS


@compiled
def shorten(path: Path, scene: CollisionScene, draws: Array, resolution: float) -> tuple[Path, int]:
    """The path with detours cut off, and how many pairs of points were drawn for it.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        scene: Shapes of the arm and the obstacles.
        draws: Random numbers from 0 to 1, two per try: shape (tries, 2).
        resolution: Control steps between checked configurations.
    """
    rows, count, tries = np.empty((len(path) + len(draws), JOINTS)), len(path), 0
    rows[:count] = path
    times, a, b = np.empty(len(rows)), np.empty(JOINTS), np.empty(JOINTS)
    while tries < len(draws) and count >= 3:
        _place_arrivals(rows, count, times)
        u, v = times[count - 1] * draws[tries, 0], times[count - 1] * draws[tries, 1]
        begin, end = min(u, v), max(u, v)
        tries += 1
        first, last = _rows_until(times, count, begin), _rows_until(times, count, end)
        if first == last:  # on the same straight piece
            continue
        _place_at(rows, times, count, begin, a)
        _place_at(rows, times, count, end, b)
        if control_steps(a, b) >= end - begin - GAIN or not is_line_free(a, b, scene, resolution):
            continue
        rest = rows[last:count].copy()
        rows[first], rows[first + 1] = a, b
        count = first + 2 + len(rest)
        rows[first + 2 : count] = rest
    return _without_repeats(rows[:count]), tries


@compiled
def straighten(path: Path, scene: CollisionScene, resolution: float) -> Path:
    """The path without the rows that can be skipped.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        scene: Shapes of the arm and the obstacles.
        resolution: Control steps between checked configurations.
    """
    rows, count, i = path.copy(), len(path), 1
    while i < count - 1:
        if is_line_free(rows[i - 1], rows[i + 1], scene, resolution):
            for row in range(i, count - 1):
                rows[row] = rows[row + 1]
            count -= 1
            i = max(1, i - 1)  # the row before may now be skipped, too
        else:
            i += 1
    return rows[:count].copy()


@inner
def _place_arrivals(rows: Path, count: int, times: Array) -> None:
    """Write when each row is reached, in control steps."""
    times[0] = 0.0
    for i in range(1, count):
        times[i] = times[i - 1] + control_steps(rows[i - 1], rows[i])


@inner
def _rows_until(times: Array, count: int, at: float) -> int:
    """How many rows are reached at a time or before."""
    row = 0
    while row < count and times[row] <= at:
        row += 1
    return row


@inner
def _place_at(rows: Path, times: Array, count: int, at: float, q: Joints) -> None:
    """Write the configuration at a time."""
    row = _rows_until(times, count, at) - 1
    for joint in range(JOINTS):
        q[joint] = rows[row, joint]
        if row < count - 1 and times[row] != at:
            slope = (rows[row + 1, joint] - rows[row, joint]) / (times[row + 1] - times[row])
            q[joint] = slope * (at - times[row]) + rows[row, joint]


@inner
def _without_repeats(path: Path) -> Path:
    """The path without rows that equal the one before."""
    kept, count = np.empty_like(path), 1
    kept[0] = path[0]
    for row in range(1, len(path)):
        if (path[row] != path[row - 1]).any():
            kept[count] = path[row]
            count += 1
    return kept[:count].copy()
