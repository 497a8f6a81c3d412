# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A cache of motion plans."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from slap_ros.motion.collision import CollisionChecker
from slap_ros.motion.errors import MotionPlanningError
from slap_ros.motion.joints import Joints, Path
from slap_ros.motion.planning import ATTEMPTS, plan_path

CAPACITY = 4096  # plans

_Key = tuple[bytes, bytes, bytes, tuple[int, ...]]  # start, goal, everything that collides, seed


class PlanCache:
    """Keeps the paths, and the failures, that were asked for most recently."""

    def __init__(self, capacity: int = CAPACITY, attempts: int = ATTEMPTS) -> None:
        """An empty cache.

        Args:
            capacity: Plans to keep; the least recently used one is removed first.
            attempts: Random paths to find for a plan where one bend will not do.
        """
        self._capacity = capacity
        self._attempts = attempts
        self._plans: OrderedDict[_Key, Path | str] = OrderedDict()  # a failure as its message

    def __len__(self) -> int:
        return len(self._plans)

    def clear(self) -> None:
        """Remove every plan, as from a new cache."""
        self._plans.clear()

    def plan_path(
        self, start: Joints, goal: Joints, free: CollisionChecker, *, seed: int | Sequence[int]
    ) -> Path:
        """What :func:`slap_ros.motion.planning.plan_path` gives, from the cache where it is there.

        Args:
            start: Configuration to start from, rad, shape (7,).
            goal: Configuration to reach, rad, shape (7,).
            free: Checker of which configurations are free of collisions.
            seed: Seed of the random numbers; it fixes the result.

        Returns:
            rad, shape (k, 7), read-only.

        Raises:
            MotionPlanningError: Now or before, there was no path.
        """
        numbers = (seed,) if isinstance(seed, int) else tuple(seed)
        key = (_bytes(start), _bytes(goal), free.key, numbers)
        if key not in self._plans:
            self._plans[key] = self._plan(start, goal, free, numbers)
            if len(self._plans) > self._capacity:
                self._plans.popitem(last=False)
        self._plans.move_to_end(key)
        plan = self._plans[key]
        if isinstance(plan, str):
            raise MotionPlanningError(plan)
        return plan

    def _plan(
        self, start: Joints, goal: Joints, free: CollisionChecker, seed: tuple[int, ...]
    ) -> Path | str:
        try:
            path = plan_path(start, goal, free, seed=seed, attempts=self._attempts)
        except MotionPlanningError as error:
            return str(error)
        path.flags.writeable = False
        return path


def _bytes(q: Joints) -> bytes:
    return (np.asarray(q, dtype=np.float64) + 0.0).tobytes()  # -0.0 is 0.0
