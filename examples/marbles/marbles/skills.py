# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The given skills: waypoints for the hand, then the fan. Lengths in m."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from marbles.environment import IN_GUTTER, MAX_STEP
from marbles.model import ROBOT
from slap_ros.core import Action, Policy
from slap_ros.relational import Object, State

HIGH = 0.1  # where the hand crosses the tray without touching anything
GRIP, RELEASE = 1.0, -1.0  # gripper commands
ARRIVED = 1e-9
STEP_LIMIT = 40  # environment steps

Point = tuple[float, float, float]


class Waypoints:
    """Visit points, then act with the fan once."""

    def __init__(self, hand: Object, points: Sequence[Point], gripper: float) -> None:
        """Begin at the first point.

        Args:
            hand: The robot.
            points: Positions of the hand, m.
            gripper: The gripper command after the last point.
        """
        self._hand, self._points, self._gripper = hand, list(points), [gripper]

    def __call__(self, state: State) -> Action | None:
        """The next action; None when all is done."""
        while self._points:
            missing = np.array(self._points[0]) - state[self._hand]
            if np.abs(missing).max() > ARRIVED:
                return np.array([*np.clip(missing, -MAX_STEP, MAX_STEP), 0.0])
            self._points.pop(0)
        return np.array([0.0, 0.0, 0.0, self._gripper.pop()]) if self._gripper else None


@dataclass(frozen=True)
class Take:
    """Over a marble, down, close."""

    name: str = "Take"
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The straight way, and the grasp."""
        hand, marble = objects
        away = np.abs(state[marble][:2] - state[hand][:2]).max()
        return int(np.ceil((away - ARRIVED) / MAX_STEP)) + 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Up if need be, over the marble, down, then close."""
        hand, marble = objects
        x, y = state[marble][:2].tolist()
        hand_x, hand_y, hand_z = state[hand].tolist()
        up = [(hand_x, hand_y, HIGH)] if hand_z < HIGH else []
        return Waypoints(hand, [*up, (x, y, HIGH), (x, y, 0.0)], GRIP)


@dataclass(frozen=True)
class Drop:
    """Carry what is held over the gutter, and open."""

    name: str = "Drop"
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The way, which is straight, and the release."""
        (hand,) = (obj for obj in objects if obj.type == ROBOT)
        away = IN_GUTTER - float(state.get(hand, "x"))
        return max(0, int(np.ceil((away - ARRIVED) / MAX_STEP))) + 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Straight over the gutter, then open."""
        hand, _ = objects
        return Waypoints(hand, [(IN_GUTTER, float(state.get(hand, "y")), HIGH)], RELEASE)


SKILLS = (Take(), Drop())
