# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: where the hand goes, as the approach and as scripts have it."""

from __future__ import annotations

import math

from slap_ros.core import Policy
from slap_ros.domains.benchtop.approach import acted_on, carried, make_approach
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, HandGoal, nearest_turn
from slap_ros.domains.benchtop.scripts import (
    CLEARANCE,
    GENTLE,
    Move,
    carry,
    follow,
    grasp,
    over,
    release,
)
from slap_ros.domains.benchtop.state_access import position_of, standing_on, yaw_of
from slap_ros.relational import Object, State

QUARTER = 0.5 * math.pi  # rad; turned by it, a cube looks the same


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Where the hand is when it grasps a cube, or when the cube that it holds is in its place."""
    held, obj = carried(state, objects), acted_on(state, objects)
    if held is None:
        return HandGoal(position_of(state, obj), nearest_turn(yaw_of(state, obj), QUARTER))
    return carry(held, standing_on(state, held, obj))(state)


APPROACH = make_approach(acts_at)


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a cube wherever it stands, and lift it."""
    *_, cube = objects
    goal = acts_at(state, objects)
    return follow(
        release(),
        *over(state, goal, OPEN),
        Move(goal, OPEN),
        *grasp(cube),
        Move(goal.raised(CLEARANCE), CLOSE),
    )


def place(state: State, objects: tuple[Object, ...]) -> Policy:
    """Put the cube in the hand down on a target or on another cube."""
    cube, under = objects
    there = standing_on(state, cube, under)
    x, y, z = there
    return follow(
        *over(state, acts_at(state, objects), CLOSE),
        Move(carry(cube, (x, y, z + CLEARANCE)), CLOSE),
        Move(carry(cube, there), CLOSE, fastest=GENTLE),
        release(),
    )


SCRIPTS = {"Pick": pick, "Unstack": pick, "Place": place}
