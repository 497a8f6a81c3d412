# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the hand is commanded: where to, and how far in one control step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Action
from slap_ros.domains.benchtop.state_access import hand_position, hand_target, hand_yaw
from slap_ros.geometry.pose import Vector
from slap_ros.portable_math import on_grid
from slap_ros.relational import State
from slap_ros.worlds.contact.hand import wrapped
from slap_ros.worlds.contact.world import MAX_SHIFT, MAX_TURN

OPEN, KEEP, CLOSE = -1.0, 0.0, 1.0  # gripper commands
NEAR = 0.002  # m, at which the hand is where it was to go
TURNED = 0.03  # rad


@dataclass(frozen=True)
class HandGoal:
    """Where the grasp point is to be, m, and how the hand is turned about the vertical, rad."""

    position: Vector
    yaw: float = 0.0

    def raised(self, height: float) -> HandGoal:
        """The same goal, so much higher, m."""
        x, y, z = self.position
        return replace(self, position=(x, y, z + height))

    def at_height(self, z: float) -> HandGoal:
        """The same goal at another height, m."""
        x, y, _ = self.position
        return replace(self, position=(x, y, z))

    def distance(self, state: State) -> float:
        """The distance from the hand to the goal, m."""
        return math.dist(self.position, hand_position(state))

    def reached(self, state: State) -> bool:
        """Whether the hand is at the goal."""
        turn = abs(self.yaw - hand_yaw(state))
        return self.distance(state) <= NEAR and turn <= TURNED


GoalOf = Callable[[State], HandGoal]  # where to, as things are now


def action_towards(
    state: State, goal: HandGoal, gripper: float = KEEP, fastest: float = MAX_SHIFT
) -> Action:
    """The action that takes the hand's target straight towards a goal.

    Args:
        state: Current state.
        goal: Goal of the hand.
        gripper: Gripper command: OPEN, KEEP or CLOSE.
        fastest: Largest shift along each axis in one control step, m.

    Returns:
        Within the limits of the action space.
    """
    target, yaw = hand_target(state)
    # Sines and angles differ in their last bit between processors. Contact amplifies that.
    *way, turn = on_grid(np.subtract((*goal.position, goal.yaw), (*target, yaw)))
    shift = np.array(way) * min(1.0, fastest / max(float(np.abs(way).max()), fastest))
    return np.array([*shift, min(max(turn, -MAX_TURN), MAX_TURN), gripper])


def nearest_turn(yaw: float, symmetry: float = 2.0 * math.pi) -> float:
    """The yaw nearest to 0 at which something looks the same, rad.

    Args:
        yaw: Any yaw at which it looks like that, rad.
        symmetry: Angle by which it can be turned and looks the same, rad: pi/2 for a cube.
    """
    return wrapped(yaw * (2.0 * math.pi / symmetry)) * symmetry / (2.0 * math.pi)
