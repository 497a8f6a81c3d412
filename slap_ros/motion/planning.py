# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collision-free paths. Budgets are counts and a seed fixes the result, whatever the load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from slap_ros.motion.errors import MotionPlanningError
from slap_ros.motion.free_space import FreeSpace, free_space
from slap_ros.motion.joints import (
    RESOLUTION,
    Free,
    Joints,
    Path,
    configuration,
    control_steps,
    path_steps,
    within_limits,
)

ATTEMPTS = 4  # paths, of which the one of fewest control steps is kept
MAX_SAMPLES = 500  # of the joint space, an attempt
SHORTENING_TRIES = 20  # tries to shorten a path
GOOD_ENOUGH = 1.05  # control steps over those of the straight way, at which no more paths are tried


def plan_path(
    start: Joints,
    goal: Joints,
    free: Free,
    *,
    seed: int | Sequence[int],
    attempts: int = ATTEMPTS,
    max_samples: int = MAX_SAMPLES,
    shortening_tries: int = SHORTENING_TRIES,
    resolution: float = RESOLUTION,
) -> Path:
    """A collision-free path: straight, over a via point, or else the best of a few random ones.

    Paths over a via point and random paths are then shortened.

    Args:
        start: Configuration to start from, rad, shape (7,).
        goal: Configuration to reach, rad, shape (7,).
        free: Checker of which configurations are free of collisions.
        seed: Seed of the random numbers; it fixes the result.
        attempts: Random paths to find if a via point will not do; fewer if one is nearly straight.
        max_samples: Number of samples of the joint space after which an attempt fails.
        shortening_tries: Pairs of points to try to join, for each path.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (k, 7): straight between rows, from exactly the start to exactly the goal. One
        row if these are the same.

    Raises:
        MotionPlanningError: Start or goal collides or is out of limits, or the first attempt
            failed.
    """
    start, goal = configuration(start), configuration(goal)
    _check_end("start", start, free)
    _check_end("goal", goal, free)
    if np.array_equal(start, goal):
        return start[None]
    space = free_space(free)
    if space.line_is_free(start, goal, resolution):
        return np.stack([start, goal])

    rng = np.random.default_rng(seed)

    def random_path() -> Path | None:
        found = space.rrt_connect(start, goal, rng, max_samples, resolution)
        return None if found is None else shortened(space.straighten(found, resolution))

    shortened = partial(
        _shortened, space=space, rng=rng, tries=shortening_tries, resolution=resolution
    )
    bent = space.via_point_path(start, goal, rng, resolution)
    if bent is not None:
        return shortened(bent)
    best = _shortest(random_path, attempts, GOOD_ENOUGH * float(control_steps(start, goal)))
    if best is None:
        raise _no_path(max_samples)
    return best


def _no_path(max_samples: int) -> MotionPlanningError:
    return MotionPlanningError(
        f"no collision-free path after {max_samples} samples; the goal may be out of reach behind "
        "obstacles, or takes more samples"
    )


def _shortened(
    path: Path, space: FreeSpace, rng: np.random.Generator, tries: int, resolution: float
) -> Path:
    """The path shortened, if what comes out is free; see :mod:`slap_ros.motion.shortcutting`."""
    shorter = space.shorten(path, rng, tries, resolution)
    shorter = space.straighten(shorter, resolution)
    # A piece of a piece is checked at other configurations than the whole of it was.
    return shorter if space.path_is_free(shorter, resolution) else path


def _shortest(make_path: Callable[[], Path | None], attempts: int, enough: float) -> Path | None:
    """The shortest of some paths; no more are made after a failure, or once one is good enough.

    Args:
        make_path: Function that makes another path; None if it fails.
        attempts: Largest number of paths.
        enough: Control steps of a path that is good enough.
    """
    best: Path | None = None
    for _ in range(attempts):
        found = make_path()
        if found is None:
            break
        if best is None or path_steps(found) < path_steps(best):
            best = found
        if path_steps(best) <= enough:
            break
    return best


def _check_end(name: str, q: Joints, free: Free) -> None:
    where = f"the {name} {np.round(q, 3).tolist()} rad"
    if not within_limits(q):
        raise MotionPlanningError(f"{where} is not within the joint limits")
    if not free(q[None]).all():
        raise MotionPlanningError(f"{where} is in collision")
