# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Path shortcutting: a path becomes shorter where two points on it are joined straight.

R. Geraerts, M. Overmars: Creating High-Quality Paths for Motion Planning, IJRR 2007, "shortcut"
and "pruning".
"""

from __future__ import annotations

import numpy as np

from slap_ros.motion.joints import Array, Free, Joints, Path, control_steps, free_count, interpolate

GAIN = 1e-6  # control steps; less is not shorter


def shorten(
    path: Path, free: Free, rng: np.random.Generator, *, tries: int, resolution: float
) -> Path:
    """The path with detours cut off where the straight way is free and takes fewer control steps.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        free: Checker of which configurations are free of collisions.
        rng: Source of random numbers for the points.
        tries: Number of pairs of points to try.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (k', 7), with the same ends.
    """
    for _ in range(tries):
        if len(path) < 3:
            break
        times = arrival_times(path)
        begin, end = np.sort(rng.uniform(0.0, times[-1], 2))
        first, last = np.searchsorted(times, (begin, end), side="right")
        if first == last:  # on the same straight piece
            continue
        a, b = points_at(path, times, np.array((begin, end)))
        if control_steps(a, b) >= end - begin - GAIN:
            continue
        line = interpolate(a, b, resolution)
        if free_count(line, free) == len(line):
            path = np.concatenate([path[:first], [a, b], path[last:]])
    return without_repeats(path)


def straighten(path: Path, free: Free, *, resolution: float) -> Path:
    """The path without the rows that can be skipped, one after the other (pruning).

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        free: Checker of which configurations are free of collisions.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (k', 7), with the same ends.
    """
    rows = list(path)
    i = 1
    while i < len(rows) - 1:
        line = interpolate(rows[i - 1], rows[i + 1], resolution)
        if free_count(line, free) == len(line):
            del rows[i]
            i = max(1, i - 1)  # the row before may now be skipped, too
        else:
            i += 1
    return np.stack(rows)


def arrival_times(path: Path) -> Array:
    """Control steps, not rounded, until each row of a path is reached: shape (k,)."""
    return np.concatenate([[0.0], np.cumsum(control_steps(path[:-1], path[1:]))])


def points_at(path: Path, times: Array, at: Array) -> Joints:
    """The configurations on a path at some times.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        times: Times at which the path's rows are reached, shape (k,), ascending.
        at: Times to interpolate at, shape (n,), in the unit of ``times``.

    Returns:
        rad, shape (n, 7).
    """
    return np.stack([np.interp(at, times, joint) for joint in path.T], axis=1)


def without_repeats(path: Path) -> Path:
    """The path without rows that equal the one before."""
    moved = (path[1:] != path[:-1]).any(1)
    return np.concatenate([path[:1], path[1:][moved]])
