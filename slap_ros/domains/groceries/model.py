# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: types, a metric, predicates, and the operators and rewards written by hand."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.metrics import (
    LIFT,
    NEAR_METRES,
    PARALLEL_DIS,
    PERPENDICULAR_DIS,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import hand_empty, holding, is_clear, on, on_table, over
from slap_ros.domains.benchtop.state_access import (
    hand_position,
    hand_positions,
    position_of,
    positions,
    value,
)
from slap_ros.relational import Column, Feature, Metric, Object, State, Type, Variable
from slap_ros.relational.state import Array

HALF_WIDTH = Feature("half_width", "m")  # half of what is between the fingers
GRASP_HEIGHT = Feature("grasp_height", "m")  # of the grasp point above the origin

GROCERY = Type("grocery", (*THING.features, HALF_WIDTH, GRASP_HEIGHT), THING)
BASKET = Type("basket", PLACE.features, PLACE)
TYPES = (PLACE, THING, GROCERY, BASKET)


def grasp_dis(state: State, grocery: Object) -> float:
    """From the point between the fingertips to where an upright thing is grasped."""
    x, y, z = position_of(state, grocery)
    return math.dist(hand_position(state), (x, y, z + value(state, grocery, "grasp_height")))


def _grasp_dis(state: State, groceries: Column) -> Array:
    x, y, z = np.moveaxis(hand_positions(state) - positions(state, groceries), -1, 0)
    distances: Array = np.sqrt(x**2 + y**2 + (z - state.stack(groceries, "grasp_height")) ** 2)
    return distances


GRASP_DIS = Metric(
    "grasp_dis",
    (GROCERY,),
    "m",
    "Distance from the hand to where the thing is grasped.",
    _grasp_dis,
    grasp_dis,
    NEAR_METRES,
    of_hand=True,
)
METRICS = (GRASP_DIS,)

HOLDING = holding(GROCERY)
HAND_EMPTY = hand_empty(HOLDING)
ON_TABLE = on_table(GROCERY)
# In the middle of the basket, where it was put: what is dropped into it lies anywhere.
IN = on(GROCERY, BASKET, "In")
IS_EMPTY = is_clear(over(GROCERY, BASKET), "IsEmpty")
PREDICATES = (HAND_EMPTY, HOLDING, ON_TABLE, IN, IS_EMPTY)

# The order is that of the goals task0, task1, ...
NAMES = (
    "bottle",
    "can",
    "milk",
    "cereal",
    "butter",
    "jar",
    "tuna",
    "sausage",
    "chocolate",
    "ketchup",
)
GOALS = {f"task{number}": goal((IN, name, "basket")) for number, name in enumerate(NAMES)}

_GROCERY, _BASKET = Variable("?grocery", GROCERY), Variable("?basket", BASKET)
PICK = operator(
    "Pick",
    [_GROCERY],
    needs=[atom(HAND_EMPTY), atom(ON_TABLE, _GROCERY)],
    adds=[atom(HOLDING, _GROCERY)],
    deletes=[atom(HAND_EMPTY), atom(ON_TABLE, _GROCERY)],
)
PLACE_IN = operator(
    "Place",
    [_GROCERY, _BASKET],
    needs=[atom(HOLDING, _GROCERY), atom(IS_EMPTY, _BASKET)],
    adds=[atom(IN, _GROCERY, _BASKET), atom(HAND_EMPTY)],
    deletes=[atom(HOLDING, _GROCERY), atom(IS_EMPTY, _BASKET)],
)
OPERATORS = (PICK, PLACE_IN)

_ONE, _BOTH = (_GROCERY,), (_GROCERY, _BASKET)
REWARDS = {
    # The paper's Pick leads the hand to the middle of a thing. A bottle is grasped 6 cm higher: its
    # hand presses on it from above, and never closes.
    "Pick": reward(PICK, (GRASP_DIS, 0.6, _ONE), (LIFT, 0.2, _ONE)),
    "Place": reward(PLACE_IN, (PARALLEL_DIS, 0.35, _BOTH), (PERPENDICULAR_DIS, 0.35, _BOTH)),
}
