# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways of the grasp point: depart upwards, cross on a planned path, come down.

What it takes to bound a way's length serves to plan it, too, and is computed once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ParamSpec, TypeVar, cast

import numpy as np

from slap_ros.domains.tabletop.planning_scene import AT_EASE, CARRYING, PlanningScene
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.errors import SkillNotApplicableError
from slap_ros.geometry.pose import Pose
from slap_ros.motion import (
    CollisionChecker,
    Free,
    Joints,
    MotionPlanningError,
    Path,
    PlanCache,
    linear_motion,
    nearest_configurations,
    path_configurations,
    path_steps,
    shifted,
)
from slap_ros.physics.panda import grasp_pose
from slap_ros.relational import Object, State

CLEARANCE = 0.05  # m, over a place before coming down to it and after leaving it
SEED = 0  # of motion plans: a plan is a function of the state alone
ATTEMPTS = 2  # random paths for a motion that needs them; more shorten it by little
PLANS = PlanCache(attempts=ATTEMPTS)
CACHE_SIZE = 1024  # answers of each function below, and of a domain's that make ways
_CLEAR_CACHES: list[Callable[[], None]] = [PLANS.clear]

Given = ParamSpec("Given")
T = TypeVar("T")


def memoized(compute: Callable[Given, T]) -> Callable[Given, T]:
    """Compute once what is asked for again, until it is forgotten: ways, above all."""
    cached = lru_cache(maxsize=CACHE_SIZE)(compute)
    _CLEAR_CACHES.append(cached.cache_clear)
    return cast(Callable[Given, T], cached)


@dataclass(frozen=True, eq=False)
class Transit:
    """How the grasp point gets to one of several poses: up, across, down.

    Args:
        scene: What to keep clear of.
        state: Where it begins.
        ends: Poses of the grasp point, any of which will do.
        touched: What the arm or its body may touch when it comes down.
    """

    scene: PlanningScene
    state: State
    ends: Sequence[Pose]
    touched: tuple[Object, ...]

    def pieces(self) -> list[Path]:
        """Up, across and down: paths in rad, shape (k, 7), each from where the last one ends.

        Raises:
            SkillNotApplicableError: None of the ends can be reached.
        """
        for descent in self.descents:
            if descent.down is None:
                continue
            try:
                across = self._across(descent)
            except MotionPlanningError:
                continue
            return [descent.up, across, descent.down]
        raise SkillNotApplicableError(f"none of {len(self.ends)} grasps can be reached from here")

    def pieces_over(self, can_end: bool) -> list[Path]:
        """Up and across alone, and then no way down.

        Args:
            can_end: Whether it must be over an end that can be come down to.

        Raises:
            SkillNotApplicableError: There is no such way.
        """
        for descent in self.descents:
            if can_end and descent.down is None:
                continue
            try:
                across = self._across(descent)
            except MotionPlanningError:
                continue
            return [descent.up, across, across[-1:]]
        raise SkillNotApplicableError(f"there is no way over any of {len(self.ends)} grasps")

    def least_steps(self, timing: Timing) -> float:
        """Control steps that it takes at least: across it may have to go round something.

        Infinite where none of the ends can be reached.
        """
        least = math.inf
        for descent in self.descents:
            towards = [descent.up, descent.straight]
            if timing.least_steps(towards) >= least:
                break  # nor are those that are further away any nearer
            if descent.down is not None:
                least = min(least, timing.least_steps([*towards, descent.down]))
        return least

    def _across(self, descent: TransitCandidate) -> Path:
        start, above = descent.straight
        return PLANS.plan_path(start, above, self.free, seed=SEED)

    @property
    def is_open(self) -> bool:
        """Whether one of the ends is reached straight across, and so surely."""
        return any(
            descent.down is not None and self.free(path_configurations(descent.straight)).all()
            for descent in self.descents
        )

    @property
    def free(self) -> CollisionChecker:
        """What is free on the way across."""
        return _free(self.scene, self.state)

    @cached_property
    def touching(self) -> CollisionChecker:
        """What is free on the way down, and where corners may be cut."""
        return self.scene.checker(self.state, self.touched)

    @cached_property
    def descents(self) -> list[TransitCandidate]:
        """To the ends that have something over them, the nearest first; none if it cannot begin."""
        up, found = _departure(self.scene, self.state), []
        if up is None:
            return []
        over = [shifted(end, (0.0, 0.0, CLEARANCE)) for end in self.ends]
        nearest = nearest_configurations(over, up[-1], free=self.free)
        for end, above in zip(self.ends, nearest, strict=True):
            if above is not None:
                found.append(TransitCandidate(up, np.stack([up[-1], above]), end, self.touching))
        return sorted(found, key=lambda descent: path_steps(descent.straight))


@dataclass(frozen=True, eq=False)
class TransitCandidate:
    """A way to one of the ends, but for what may be between."""

    up: Path  # rad, shape (k, 7)
    straight: Path  # across, if nothing were in between: rad, shape (2, 7)
    end: Pose  # of the grasp point
    free: Free  # on the way down

    @cached_property
    def down(self) -> Path | None:
        """The path in rad, shape (k, 7), if there is one."""
        return linear_motion(self.straight[-1], self.end, free=self.free)


@memoized
def _departure(scene: PlanningScene, state: State) -> Path | None:
    """Straight up, where the fingers or the body in them are still close to something.

    Higher, where one cannot go across from there: shortcuts leave a hand deep between things.
    """
    q = joints_of(state)
    if scene.checker(state, held_margin=AT_EASE)(q[None])[0]:
        return q[None]
    low = _up(q, CLEARANCE)
    if low is None or _free(scene, state)(low[-1:])[0]:
        return low
    high = _up(q, 2.0 * CLEARANCE)
    return high if high is not None and _free(scene, state)(high[-1:])[0] else low


def _up(q: Joints, rise: float) -> Path | None:
    return linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, rise)))


@memoized
def _free(scene: PlanningScene, state: State) -> CollisionChecker:
    return scene.checker(state, held_margin=CARRYING)


def clear_caches() -> None:
    """Forget every motion, for fair measurements; nothing else changes."""
    for clear in _CLEAR_CACHES:
        clear()
