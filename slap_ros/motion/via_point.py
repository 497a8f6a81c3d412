# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Around an obstacle over a single via point, which is mostly enough.

The slowest joint alone sets the length of a path, so while it is on its way the others may well
make a detour. How long a via point makes the path is known at once, whether the path is free is
not: many are drawn and checked from the shortest path on. The first free one is taken, so that the
paths that it dominates are never checked.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from slap_ros.motion.joints import (
    STEP,
    Free,
    Joints,
    Path,
    control_steps,
    path_configurations,
    within_limits,
)
from slap_ros.worlds.panda import JOINTS

VIA_POINTS = 512  # to choose from
SPREAD = 10.0  # control steps, the largest standard deviation from the straight way
_MIDDLE = 0.2, 0.8  # where on the straight way
_BATCH = 32  # via points that are checked together
COARSE_CHECKS = 1, 3, 6  # configurations each way: a few reveal most blocked paths


def via_point_path(
    start: Joints, goal: Joints, free: Free, rng: np.random.Generator, *, resolution: float
) -> Path | None:
    """The free path of fewest control steps, of many with one via point.

    Args:
        start: Free configuration to start from, rad, shape (7,).
        goal: Free configuration to reach, rad, shape (7,).
        free: Checker of which configurations are free of collisions.
        rng: Source of random numbers for the via points.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (3, 7); None if none of them is free.
    """
    via_points = draw_via_points(start, goal, rng)
    for i in range(0, len(via_points), _BATCH):
        batch = via_points[i : i + _BATCH]
        for count in COARSE_CHECKS:
            checked = _spread_along(start, batch, goal, count)
            batch = batch[free(checked.reshape(-1, JOINTS)).reshape(checked.shape[:2]).all(0)]
        for via_point in batch:
            path: Path = np.stack([start, via_point, goal])
            if free(path_configurations(path, resolution)).all():
                return path
    return None


def draw_via_points(start: Joints, goal: Joints, rng: np.random.Generator) -> Joints:
    """Configurations around the straight way, those of the shortest paths first.

    Args:
        start: Configuration to start from, rad, shape (7,).
        goal: Configuration to reach, rad, shape (7,).
        rng: Source of random numbers.

    Returns:
        rad, shape (k, 7), within the limits.
    """
    along = rng.uniform(*_MIDDLE, (VIA_POINTS, 1))
    aside = rng.uniform(0.0, SPREAD, (VIA_POINTS, 1)) * rng.normal(size=(VIA_POINTS, JOINTS))
    q = start + along * (goal - start) + aside * STEP
    q = q[within_limits(q)]
    lengths = control_steps(start, q) + control_steps(q, goal)
    return cast(Joints, q[np.argsort(lengths, kind="stable")])


def _spread_along(start: Joints, via_points: Joints, goal: Joints, count: int) -> Joints:
    """So many configurations each way from via points: rad, shape (2 count - 1, k, 7)."""
    fractions = np.arange(1, count + 1)[:, None, None] / count
    there, back = (end + fractions * (via_points - end) for end in (start, goal))
    return np.concatenate([there, back[:-1]])  # the via points themselves once
