# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: where the hand goes, as the approach and as scripts have it."""

from __future__ import annotations

import math
from dataclasses import replace

from slap_ros.core import Policy
from slap_ros.domains.benchtop.approach import make_approach
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
    travel_height,
)
from slap_ros.domains.benchtop.state_access import standing_on
from slap_ros.domains.bowls.scenery import GRIP
from slap_ros.geometry.pose import Pose, rotate
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of

LIFT = 0.06  # m, from where a bowl was grasped


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a bowl at its rim, and lift it."""
    (bowl,) = objects
    goal = rim_of(state, bowl)
    return follow(
        release(),
        *over(state, goal, OPEN),
        Move(goal.raised(CLEARANCE), OPEN),
        Move(lambda now: replace(rim_of(now, bowl), yaw=goal.yaw), OPEN, fastest=GENTLE),
        *grasp(bowl),
        Move(goal.raised(LIFT), CLOSE),
    )


def place(state: State, objects: tuple[Object, ...]) -> Policy:
    """Put the bowl in the hand down on the plate."""
    bowl, plate = objects
    x, y, z = there = standing_on(state, bowl, plate)
    return follow(
        *over(state, acts_at(state, objects), CLOSE),
        Move(carry(bowl, (x, y, z + CLEARANCE)), CLOSE),
        Move(carry(bowl, there), CLOSE, fastest=GENTLE),
        release(),
        Move(acts_at(state, objects).at_height(travel_height(state)), OPEN),
    )


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Where the hand grasps a bowl, or where it is when the bowl that it holds is in its place."""
    bowl = objects[0]
    if len(objects) == 1:
        return rim_of(state, bowl)
    return carry(bowl, standing_on(state, bowl, objects[1]))(state)


def rim_of(state: State, bowl: Object) -> HandGoal:
    """The hand around the rim of a bowl, at the wall on the bowl's left."""
    return rim_at(pose_of(state, bowl))


def rim_at(pose: Pose) -> HandGoal:
    """The hand around the rim of a bowl that stands at a pose."""
    x, y, _ = rotate(pose.quaternion, (1.0, 0.0, 0.0))
    return HandGoal(pose.apply(GRIP), nearest_turn(math.atan2(y, x), math.pi))


APPROACH = make_approach(acts_at)
SCRIPTS = {"Pick": pick, "Place": place}
