# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: types, predicates, and the operators and rewards written by hand."""

from __future__ import annotations

from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.metrics import (
    DIS_TO_OBJ,
    PARALLEL_DIS,
    PERPENDICULAR_DIS,
    XY_DIS,
    Z_DIS,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import hand_empty, holding, is_clear, on, on_table, over
from slap_ros.relational import Feature, Type, Variable

HALF_WIDTH = Feature("half_width", "m")  # half of what is between the fingers
GRASP_HEIGHT = Feature("grasp_height", "m")  # of the grasp point above the origin

GROCERY = Type("grocery", (*THING.features, HALF_WIDTH, GRASP_HEIGHT), THING)
BASKET = Type("basket", PLACE.features, PLACE)
TYPES = (PLACE, THING, GROCERY, BASKET)

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
REWARDS = {  # the weights that the paper prints (App. C.2)
    "Pick": reward(PICK, (DIS_TO_OBJ, 0.4, _ONE), (XY_DIS, 0.2, _ONE), (Z_DIS, 0.2, _ONE)),
    "Place": reward(PLACE_IN, (PARALLEL_DIS, 0.35, _BOTH), (PERPENDICULAR_DIS, 0.35, _BOTH)),
}
