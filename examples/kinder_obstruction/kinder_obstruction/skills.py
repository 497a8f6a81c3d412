# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The given skills: take a block from above, put it down. Lengths in m.

The hand points down. Robot and blocks follow commands to within a millimetre, so each skill is a
list of places that are approached with the full step, one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinder_obstruction.environment import ACTIONS, CONFIG
from kinder_obstruction.model import (
    BESIDE_ROOM,
    BLOCK,
    LEFTMOST,
    RIGHTMOST,
    SURFACE,
    TABLE,
    can_be_taken,
    edges,
)
from slap_ros.core import Action, Policy
from slap_ros.errors import SkillNotApplicableError
from slap_ros.relational import Object, State

DOWN = -np.pi / 2  # rad, where the arm points
REACH = 0.06  # of a block between the fingers, from the palm
TIP = CONFIG.gripper_finger_width  # from the palm to the fingertips
OVER = 0.02  # between what moves and what it passes over
ABOVE_TABLE = 0.004  # a block's bottom when it is let go
OPENING = 0.1  # of the gap on top of a block's width, when the hand comes down
OPEN = CONFIG.max_dgripper  # of the gap in a step
ARRIVED = np.array([2e-3, 2e-3, 5e-3, 4e-3])  # m, m, rad, m
FASTEST = 0.055  # m in a step, seen; commands are at most 0.05
STEP_LIMIT = 120  # environment steps
LOW, HIGH = np.array(ACTIONS.low), np.array(ACTIONS.high)

Goal = tuple[float, float, float, float]  # x, y of the base, turn, gap between the fingers


class Waypoints:
    """Go to places, then move the fingers one way for good."""

    def __init__(self, robot: Object, goals: Sequence[Goal], fingers: float) -> None:
        """Begin at the first place.

        Args:
            robot: The robot.
            goals: Places of its base; NaN: wherever it is.
            fingers: The gripper command after the last place, m.
        """
        self._robot, self._goals, self._fingers = robot, list(goals), fingers

    def __call__(self, state: State) -> Action:
        """The next action."""
        robot = self._robot
        now = [state.get(robot, name) for name in ("x", "y", "theta", "finger_gap")]
        while self._goals:
            missing = np.nan_to_num(np.array(self._goals[0]) - np.array(now, dtype=float))
            if (np.abs(missing) > ARRIVED).any():
                x, y, turn, gap = missing
                return np.clip([x, y, turn, 0.0, gap], LOW, HIGH)
            self._goals.pop(0)
        return np.array([0.0, 0.0, 0.0, 0.0, self._fingers])


def _top(state: State, block: Object) -> float:
    return float(state.get(block, "y") + state.get(block, "height") / 2)


def _others(state: State, block: Object) -> list[Object]:
    return [o for o in state.layout.of_type(BLOCK) if o != block]


def _steps(distance: float) -> int:
    return max(0, int(np.ceil((distance - ARRIVED[0]) / FASTEST)))


@dataclass(frozen=True)
class Pick:
    """Rise, over the block, down, close."""

    name: str
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The way along x."""
        robot, block = objects[:2]
        half = float(state.get(block, "width")) / 2
        return max(1, _steps(abs(float(state.get(block, "x") - state.get(robot, "x"))) - half))

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Where the hand has to go.

        Raises:
            SkillNotApplicableError: The block lies on its side, or the hand cannot get around it.
        """
        robot, block = objects[:2]
        if abs(np.sin(state.get(block, "theta"))) > 0.05 or not can_be_taken(state, block):
            raise SkillNotApplicableError(f"{block.name} cannot be taken from above")
        arm = float(state.get(robot, "arm_joint"))
        tops = [_top(state, b) for b in state.layout.of_type(BLOCK)]
        here, high = (float(state.get(robot, axis)) for axis in ("x", "y"))
        # Where the arm can turn without touching anything: it is longer than high.
        high = max(high, max(tops) + OVER + float(np.hypot(arm + TIP, 0.2)))
        x = float(state.get(block, "x"))
        gap = min(CONFIG.finger_gap_max, float(state.get(block, "width")) + OPENING)
        low = _top(state, block) + REACH + arm
        # A block that was just let go is still between the fingers: they must not close yet.
        opened = max(gap, float(state.get(robot, "finger_gap")))
        goals = [(here, high, np.nan, opened), (x, high, DOWN, gap), (x, low, DOWN, gap)]
        return Waypoints(robot, goals, -OPEN)


@dataclass(frozen=True)
class Place:
    """Rise, over the place, down, open."""

    name: str
    on_surface: bool
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The way along x, for the target; others may be put anywhere."""
        _, block, surface = objects[:3]
        if not self.on_surface:
            return 1
        slack = float(state.get(surface, "width") - state.get(block, "width")) / 2
        away = abs(float(state.get(surface, "x") - state.get(block, "x")))
        return max(1, _steps(away - slack))

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Where the hand has to go.

        Raises:
            SkillNotApplicableError: It is held askew, or there is no free place.
        """
        robot, block, surface = objects[:3]
        if abs(np.sin(state.get(block, "theta"))) > 0.05:
            raise SkillNotApplicableError(f"{block.name} is held askew")
        x, y = (float(state.get(robot, axis)) for axis in ("x", "y"))
        offset = float(state.get(block, "x")) - x
        bottom = float(state.get(block, "y") - state.get(block, "height") / 2)
        place = float(state.get(surface, "x")) if self.on_surface else _free_x(state, block)
        lift = max(0.0, max(_top(state, o) for o in _others(state, block)) + OVER - bottom)
        down = y + TABLE + ABOVE_TABLE - bottom
        gap = np.nan
        goals = [(x, y + lift, DOWN, gap), (place - offset, y + lift, DOWN, gap)]
        return Waypoints(robot, [*goals, (place - offset, down, DOWN, gap)], OPEN)


def _free_x(state: State, block: Object) -> float:
    """The nearest place at which a block leaves the surface, and room for fingers.

    Raises:
        SkillNotApplicableError: There is none.
    """
    now, half = float(state.get(block, "x")), float(state.get(block, "width")) / 2
    (surface,) = state.layout.of_type(SURFACE)
    taken = [edges(state, other) for other in _others(state, block)]
    taken.append(edges(state, surface))
    places = np.arange(LEFTMOST, RIGHTMOST, 0.02)
    free = [
        place
        for place in places.tolist()
        if all(
            place + half + 2 * BESIDE_ROOM < left or place - half - 2 * BESIDE_ROOM > right
            for left, right in taken
        )
    ]
    if not free:
        raise SkillNotApplicableError(f"there is no free place for {block.name} on the table")
    return min(free, key=lambda place: (abs(place - now), place))


SKILLS = (
    Pick("PickTarget"),
    Pick("PickObstruction"),
    Place("PlaceTarget", on_surface=True),
    Place("PlaceObstruction", on_surface=False),
)
