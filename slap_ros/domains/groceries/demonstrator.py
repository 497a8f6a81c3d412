# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: where skills act, and the scripts that show how it is done."""

from __future__ import annotations

import math
from collections.abc import Mapping

from slap_ros.core import Policy, Script
from slap_ros.domains.benchtop import scripts
from slap_ros.domains.benchtop.approach import make_approach
from slap_ros.domains.benchtop.hand_motion import CLOSE, KEEP, OPEN, HandGoal, nearest_turn
from slap_ros.domains.benchtop.scripts import GENTLE, Move, carry, follow, grasp, over, release
from slap_ros.domains.benchtop.state_access import (
    hand_target,
    position_of,
    standing_on,
    value,
    yaw_of,
)
from slap_ros.domains.groceries.model import GRASP_HEIGHT, PICK, PLACE_IN
from slap_ros.domains.groceries.scenery import WALL_HEIGHT
from slap_ros.relational import Object, State

NEAR = 0.03  # m over where the hand is to be, from which on it is slow
LIFT = 0.06  # m, from where a thing was grasped
LOWERED_TO = 0.002  # m over the basket's floor, where a thing is let go


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a thing from above, and lift it."""
    (thing,) = objects
    goal = grasp_at(state, thing)
    return follow(
        release(),
        *over(state, goal, OPEN, travel_height(state)),
        Move(goal.raised(NEAR), OPEN),
        Move(lambda now: grasp_at(now, thing), OPEN, fastest=GENTLE),
        *grasp(thing),
        straight_up(goal.position[2] + LIFT, CLOSE),
    )


def place(state: State, objects: tuple[Object, ...]) -> Policy:
    """Bring a thing over the basket, lower it, and let it go."""
    thing, basket = objects
    x, y, z = standing_on(state, thing, basket)
    goal = carry(thing, (x, y, z + LOWERED_TO))
    height = travel_height(state)
    return follow(
        straight_up(height),
        Move(lambda now: goal(now).at_height(height)),
        Move(lambda now: goal(now).raised(NEAR)),
        Move(goal, fastest=GENTLE),
        release(),
        straight_up(height, OPEN),
    )


def grasp_at(state: State, thing: Object) -> HandGoal:
    """The hand around a thing, its fingers along the thing's y."""
    x, y, z = position_of(state, thing)
    height = z + value(state, thing, GRASP_HEIGHT.name)
    return HandGoal((x, y, height), nearest_turn(yaw_of(state, thing), math.pi))


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Around what is picked, or where what is held stands in the basket."""
    thing = objects[0]
    if len(objects) == 1:
        return grasp_at(state, thing)
    return carry(thing, standing_on(state, thing, objects[1]))(state)


def travel_height(state: State) -> float:
    """Over what things stand on, and over the walls around that."""
    return scripts.travel_height(state) + WALL_HEIGHT


def straight_up(z: float, gripper: float = KEEP) -> Move:
    """The move straight up to a height, from wherever the hand is then.

    Args:
        z: Height of the grasp point, m.
        gripper: Gripper command: OPEN, KEEP or CLOSE.
    """

    def goal(state: State) -> HandGoal:
        position, yaw = hand_target(state)
        return HandGoal(position, yaw).at_height(z)

    return Move(goal, gripper)


APPROACH = make_approach(acts_at, height=travel_height)
SCRIPTS: Mapping[str, Script] = {PICK.name: pick, PLACE_IN.name: place}
