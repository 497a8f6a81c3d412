# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Configurations of the arm as arrays, and distances between them in control steps."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import cast

import numpy as np
from numpy.typing import NDArray

from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, JOINTS, MAX_STEP

Array = NDArray[np.float64]
Joints = Array  # rad, shape (7,), or (n, 7) for many configurations
Path = Array  # rad, shape (k, 7): straight between one row and the next
Free = Callable[[Joints], NDArray[np.bool_]]  # (n, 7) to (n,): True where nothing collides

LOW, HIGH, STEP = np.array(JOINT_LOW), np.array(JOINT_HIGH), np.array(MAX_STEP)
RESOLUTION = 0.125  # control steps between checked configurations: the hand moves about 1 cm

ROUNDING = 1e-9  # rad
STRIDE = 8  # rows from one that is checked first to the next


def configuration(q: Joints) -> Joints:
    """A configuration as an array of its own, shape (7,).

    Raises:
        ValueError: It has another shape or is not finite.
    """
    array = np.array(q, dtype=np.float64)
    if array.shape != (JOINTS,) or not np.isfinite(array).all():
        raise ValueError(f"a configuration has {JOINTS} finite joint positions, got {q}")
    return array


def control_steps(start: Joints, goal: Joints) -> Array:
    """Control steps from one configuration straight to another, not rounded: the slowest joint's.

    Args:
        start: Configurations to start from, rad, shape (..., 7).
        goal: Configurations to reach, rad, shape (..., 7).
    """
    return cast(Array, (np.abs(goal - start) / STEP).max(-1))


def within_limits(q: Joints) -> NDArray[np.bool_]:
    """Whether every joint is within its limits; never for NaN. Shape (..., 7) to (...)."""
    return cast(NDArray[np.bool_], ((q >= LOW - ROUNDING) & (q <= HIGH + ROUNDING)).all(-1))


def interpolate(start: Joints, goal: Joints, resolution: float = RESOLUTION) -> Joints:
    """Configurations on the straight line, the goal among them and the start not.

    Args:
        start: Configuration to start from, rad, shape (7,).
        goal: Configuration to reach, rad, shape (7,).
        resolution: Largest distance between neighbours, control steps.

    Returns:
        rad, shape (n, 7), n >= 1; the last row is exactly the goal.
    """
    count = max(1, int(np.ceil(control_steps(start, goal) / resolution)))
    fractions = np.arange(1, count + 1)[:, None] / count
    line = start + fractions * (goal - start)
    line[-1] = goal  # exactly
    return line


def free_count(line: Joints, free: Free) -> int:
    """How many rows of a line come before the first that is not free.

    A few rows spread over the line are checked first: most blocked lines are found out by them.
    """
    rows = np.arange(len(line))
    first = rows % STRIDE == (len(line) - 1) % STRIDE  # the last row among them
    coarse = rows[first]
    allowed = free(line[coarse])
    blocked = len(line) if allowed.all() else int(coarse[np.argmin(allowed)])
    rest = rows[:blocked][~first[:blocked]]
    if len(rest) == 0:
        return blocked
    allowed = free(line[rest])
    return blocked if allowed.all() else int(rest[np.argmin(allowed)])


def path_configurations(path: Path, resolution: float = RESOLUTION) -> Joints:
    """Configurations all along a path, its start first."""
    lines = [interpolate(a, b, resolution) for a, b in pairwise(path)]
    return np.concatenate([path[:1], *lines])


def path_steps(path: Path) -> float:
    """Control steps along a path, not rounded."""
    return float(control_steps(path[:-1], path[1:]).sum())
