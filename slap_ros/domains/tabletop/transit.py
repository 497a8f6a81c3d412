# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Transits of the grasp point: retreat upwards, cross on a planned path, approach downwards.

What it takes to bound a transit's length serves to plan it, too, and is computed once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slap_ros.domains.tabletop.memory import forgotten_with_all, memoized
from slap_ros.domains.tabletop.planning_scene import CARRYING, RELAXED, PlanningScene
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
from slap_ros.relational import Object, State
from slap_ros.worlds.panda import grasp_pose

CLEARANCE = 0.05  # m, over a place before the approach and after the retreat
HIGHER = 2.0 * CLEARANCE  # m, where things as high as what is held stand close to the place
LOWER = 0.4 * CLEARANCE  # m, where something is in the way further up
RETREATS = (CLEARANCE, HIGHER, LOWER, 3.0 * CLEARANCE, 4.0 * CLEARANCE)  # m, as they are tried
SEED = 0  # of motion plans: a plan is a function of the state alone
ATTEMPTS = 2  # random paths for a motion that needs them; more shorten it by little
PLANS = PlanCache(attempts=ATTEMPTS)
forgotten_with_all(PLANS.clear)


@dataclass(frozen=True, eq=False)
class Transit:
    """How the grasp point gets to one of several goals: retreat, crossing, approach.

    Args:
        scene: Collision geometry of the domain.
        state: State in which the transit begins.
        goals: Poses of the grasp point, any of which will do.
        touched: Objects that the arm or its body may touch during the approach.
        clearance: Distance between a goal and where the crossing to it ends, m.
    """

    scene: PlanningScene
    state: State
    goals: Sequence[Pose]
    touched: tuple[Object, ...]
    clearance: float = CLEARANCE

    def from_higher(self) -> Transit:
        """The same transit with an approach that begins twice as high."""
        return replace(self, clearance=HIGHER)

    def paths(self) -> list[Path]:
        """Retreat, crossing and approach to the nearest goal that can be reached.

        Returns:
            Three paths, rad, shape (k, 7), each from where the last one ends.

        Raises:
            SkillNotApplicableError: None of the goals can be reached.
        """
        for candidate in self.candidates:
            if candidate.approach is None:
                continue
            try:
                crossing = self._crossing(candidate)
            except MotionPlanningError:
                continue
            return [candidate.retreat, crossing, candidate.approach]
        raise SkillNotApplicableError(f"none of {len(self.goals)} grasps can be reached from here")

    def paths_over(self, approachable: bool) -> list[Path]:
        """Retreat and crossing alone, to over the nearest goal that can be reached.

        Args:
            approachable: Whether it must be over a goal with an approach.

        Returns:
            As :meth:`paths`, with an approach of one row.

        Raises:
            SkillNotApplicableError: There is no such way.
        """
        for candidate in self.candidates:
            if approachable and candidate.approach is None:
                continue
            try:
                crossing = self._crossing(candidate)
            except MotionPlanningError:
                continue
            return [candidate.retreat, crossing, crossing[-1:]]
        raise SkillNotApplicableError(f"there is no way over any of {len(self.goals)} grasps")

    def least_steps(self, timing: Timing) -> float:
        """A lower bound in control steps: the crossing may have to go round something.

        Infinite where none of the goals can be reached.
        """
        least = math.inf
        for candidate in self.candidates:
            towards = [candidate.retreat, candidate.direct]
            if timing.least_steps(towards) >= least:
                break  # the candidates that follow are no nearer
            if candidate.approach is not None:
                least = min(least, timing.least_steps([*towards, candidate.approach]))
        return least

    def _crossing(self, candidate: TransitCandidate) -> Path:
        start, above = candidate.direct
        return PLANS.plan_path(start, above, self.free, seed=SEED)

    @property
    def is_reachable(self) -> bool:
        """Whether one of the goals is, from over it: there may be no crossing to there."""
        return any(candidate.approach is not None for candidate in self.candidates)

    @property
    def is_open(self) -> bool:
        """Whether one of the goals is reached by a direct crossing, and so surely."""
        return any(
            candidate.approach is not None
            and self.free(path_configurations(candidate.direct)).all()
            for candidate in self.candidates
        )

    @property
    def free(self) -> CollisionChecker:
        """What is free while crossing."""
        return _free(self.scene, self.state)

    @cached_property
    def touching(self) -> CollisionChecker:
        """What is free during the approach, and where corners may be cut."""
        return self.scene.checker(self.state, self.touched)

    @cached_property
    def candidates(self) -> list[TransitCandidate]:
        """To goals that can be reached from above, the nearest first; none without a retreat."""
        retreat, found = _retreat(self.scene, self.state), []
        if retreat is None:
            return []
        over = [shifted(goal, (0.0, 0.0, self.clearance)) for goal in self.goals]
        nearest = nearest_configurations(over, retreat[-1], free=self.free)
        for goal, above in zip(self.goals, nearest, strict=True):
            if above is not None:
                direct = np.stack([retreat[-1], above])
                found.append(TransitCandidate(retreat, direct, goal, self.touching))
        return sorted(found, key=lambda candidate: path_steps(candidate.direct))


@dataclass(frozen=True, eq=False)
class TransitCandidate:
    """A transit to one of the goals, as if no obstacle were in the way of the crossing."""

    retreat: Path  # rad, shape (k, 7)
    direct: Path  # the crossing, if nothing were in between: rad, shape (2, 7)
    goal: Pose  # of the grasp point
    free: Free  # during the approach

    @cached_property
    def approach(self) -> Path | None:
        """The path down, rad, shape (k, 7), if there is one."""
        return linear_motion(self.direct[-1], self.goal, free=self.free)


@memoized
def _retreat(scene: PlanningScene, state: State) -> Path | None:
    """Straight up, where the fingers or the body in them are still close to something.

    Higher or less high, where one cannot cross from there: shortcuts leave a hand deep between
    things, or beside what it touches again further up.
    """
    q = joints_of(state)
    if scene.checker(state, held_margin=RELAXED)(q[None])[0]:
        return q[None]
    for height in RETREATS:
        up = _up(q, height)
        if up is not None and _free(scene, state)(up[-1:])[0]:
            return up
    return _up(q, CLEARANCE)


def _up(q: Joints, height: float) -> Path | None:
    return linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, height)))


@memoized
def _free(scene: PlanningScene, state: State) -> CollisionChecker:
    return scene.checker(state, held_margin=CARRYING)
