# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stow Hammer: where skills act, and scripts that do what the operators say. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping

from slap_ros.core import Policy, Script
from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.approach import acted_on, carried
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, GoalOf, HandGoal, nearest_turn
from slap_ros.domains.benchtop.scripts import GENTLE, Move, follow, grasp, over, release
from slap_ros.domains.benchtop.state_access import (
    hand_position,
    hand_yaw,
    position_of,
    value,
    yaw_of,
)
from slap_ros.domains.stow_hammer.scenery import HAMMER
from slap_ros.relational import Object, State

LIFT = 0.08  # of a hammer that was picked
PRESS = 0.002  # over the drawer's floor, where a hammer is let go
# By how much a hammer is turned where Place begins: let fall as the paper's approach has it, in the
# right direction, one of three would lie where it belongs.
TURNED = (0.25, 0.5)  # rad, least and most
AHEAD = 0.5 * math.pi  # yaw of a hand that the arm has easily everywhere


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Where a skill acts: a hammer's middle, a handle, or where a held hammer is at its place."""
    hammer, there = carried(state, objects), acted_on(state, objects)
    if hammer is not None:
        return stowing(hammer, there)(state)
    return at_hammer(state, there) if there.type.is_a(HAMMER) else drawers.at_handle(state, there)


def at_hammer(state: State, hammer: Object) -> HandGoal:
    """Where the hand grasps a hammer; either way round."""
    turn = nearest_turn(yaw_of(state, hammer) - AHEAD, math.pi)
    return HandGoal(position_of(state, hammer), AHEAD + turn)


def stowing(hammer: Object, cabinet: Object, height: float = 0.0) -> GoalOf:
    """Where the hand must be for the hammer in it to be in the middle of a drawer.

    Args:
        hammer: Hammer in the hand.
        cabinet: Cabinet that has the drawer.
        height: Height of the hammer over its place on the drawer's floor, m.
    """

    def goal(state: State) -> HandGoal:
        x, y, floor = drawers.middle_of(state, cabinet)
        place = (x, y, floor + value(state, hammer, "rest_height") + height)
        at = position_of(state, hammer)
        turn = nearest_turn(yaw_of(state, cabinet) - yaw_of(state, hammer), math.pi)
        hx, hy, hz = (h + p - o for h, p, o in zip(hand_position(state), place, at, strict=True))
        return HandGoal((hx, hy, hz), hand_yaw(state) + turn)

    return goal


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a hammer in its middle and lift it."""
    (hammer,) = objects
    goal = at_hammer(state, hammer)
    return follow(
        release(),
        *over(state, goal, OPEN, drawers.TRAVEL_HEIGHT),
        Move(lambda now: at_hammer(now, hammer), OPEN),
        *grasp(hammer),
        Move(goal.raised(LIFT), CLOSE),
    )


def place(state: State, objects: tuple[Object, ...]) -> Policy:
    """Put a hammer into a drawer, along its front, and let it go."""
    hammer, cabinet = objects
    return follow(
        *over(state, stowing(hammer, cabinet)(state), CLOSE, drawers.TRAVEL_HEIGHT),
        Move(stowing(hammer, cabinet, PRESS), CLOSE, fastest=GENTLE),
        release(),
    )


SCRIPTS: Mapping[str, Script] = {**drawers.SCRIPTS, "Pick": pick, "Place": place}
