# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Retiming: from paths to joint positions at each control step, as fast as the joints allow.

The arm has a velocity limit for each joint and none on acceleration, so the time-optimal timing of
a straight piece is that of its slowest joint at full speed throughout.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slap_ros.motion.free_space import free_space
from slap_ros.motion.joints import (
    RESOLUTION,
    STEP,
    Array,
    Free,
    Joints,
    Path,
)
from slap_ros.motion.shortcutting import points_at, without_repeats
from slap_ros.worlds.panda import MAX_STEP

PAPER_STEPS = 10  # control steps a straight piece, in the preset `paper`
_ROUNDING = 1e-9  # control steps


def retime(
    path: Path,
    max_step: Sequence[float] | Array = MAX_STEP,
    steps_multiple: int = 1,
    *,
    free: Free | None = None,
    resolution: float = RESOLUTION,
) -> Joints:
    """Joint positions at each control step, as few as the slowest joint allows along the path.

    The arm passes corners without stopping: a step may begin before a corner and end behind it.
    All joints move straight within a step and so cut it; where that is not free, a step ends at
    the corner, which costs up to one step.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        max_step: Largest change of each joint in a control step, rad, shape (7,).
        steps_multiple: The number of control steps is rounded up to a multiple of this.
        free: Checker of which configurations are free of collisions; if given, cut corners are
            checked.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (n, 7), all on the path; the start is left out, the last is exactly the goal.
        n is 0 for a path without length.
    """
    path = without_repeats(path)
    limits = np.asarray(max_step)
    if free is None:
        pieces = [path]
    elif steps_multiple == 1:
        pieces = _pieces(path, limits, free, resolution)
    else:  # more steps would cut the corners elsewhere
        pieces = _straight_pieces(path) or [path]
    counts = [_count(piece, limits) for piece in pieces]
    counts[-1] += -sum(counts) % steps_multiple
    motions = [_evenly(piece, n, limits) for piece, n in zip(pieces, counts, strict=True)]
    return np.concatenate(motions)


def retime_fixed_steps(path: Path, steps: int = PAPER_STEPS, *, per_radian: bool = False) -> Joints:
    """Joint positions at each control step, a multiple of a number for every straight piece.

    The timing of the preset ``paper``: the joint limits a step are ignored.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        steps: Control steps per straight piece.
        per_radian: Whether a piece takes ``steps`` once per begun radian of the joint that turns
            most, instead of once however long it is.

    Returns:
        rad, shape (n, 7), n a multiple of ``steps``; the start is left out.
    """
    motions = [
        _evenly(piece, steps * (_radians_begun(piece) if per_radian else 1))
        for piece in _straight_pieces(path)
    ]
    return np.concatenate([np.empty((0, path.shape[1])), *motions])


def _radians_begun(piece: Path) -> int:
    return math.ceil(float(np.abs(piece[1] - piece[0]).max()))


def _straight_pieces(path: Path) -> list[Path]:
    return [path[i : i + 2] for i in range(len(path) - 1)]


def _pieces(path: Path, limits: Array, free: Free, resolution: float) -> list[Path]:
    """The path, cut at the corners where a step must end."""
    times = _arrivals(path, limits)
    motion = np.vstack([path[:1], _evenly(path, _count(path, limits), limits)])
    space = free_space(free)
    if space.path_is_free(motion, resolution):
        return [path]
    step = times[-1] / max(len(motion) - 1, 1)
    for i, (begin, end) in enumerate(pairwise(motion)):
        corners = ((times > i * step) & (times < (i + 1) * step)).nonzero()[0]
        if len(corners) and not space.line_is_free(begin, end, resolution):
            corner = int(corners[0])
            first = _pieces(path[: corner + 1], limits, free, resolution)
            return first + _pieces(path[corner:], limits, free, resolution)
    return [path]


def _arrivals(path: Path, limits: Array) -> Array:
    """Control steps, not rounded, until each row: shape (k,)."""
    durations = (np.abs(path[1:] - path[:-1]) / limits).max(1)
    return np.concatenate([[0.0], np.cumsum(durations)])


def _count(path: Path, limits: Array) -> int:
    return int(np.ceil(_arrivals(path, limits)[-1] - _ROUNDING))


def _evenly(path: Path, count: int, limits: Array = STEP) -> Joints:
    """The whole path at one speed, in ``count`` steps."""
    times = _arrivals(path, limits)
    motion = points_at(path, times, times[-1] * np.arange(1, count + 1) / max(count, 1))
    motion[-1:] = path[-1]  # exactly
    return motion
