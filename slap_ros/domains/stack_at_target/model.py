# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: types, predicates, and operators and rewards written by hand (LG-SAIL §5)."""

from __future__ import annotations

from slap_ros.domains.benchtop import predicates
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
from slap_ros.relational import Type, Variable

CUBE = Type("cube", THING.features, THING)
TARGET = Type("target", PLACE.features, PLACE)
TYPES = (PLACE, THING, CUBE, TARGET)


# -- predicates -----------------------------------------------------------------------------------

HOLDING = predicates.holding(CUBE)
HAND_EMPTY = predicates.hand_empty(HOLDING)
ON_TABLE = predicates.on_table(CUBE)
ON = predicates.on(CUBE, PLACE)  # of a target, the paper's OnTarget
IS_CLEAR = predicates.is_clear(predicates.over(CUBE, PLACE))
PREDICATES = (HAND_EMPTY, HOLDING, ON_TABLE, ON, IS_CLEAR)

GOALS = {
    "training": goal((ON, "cube1", "cube0"), (ON, "cube0", "target0")),
    "real": goal((ON, "cube1", "target0"), (ON, "cube0", "cube1")),
}


# -- operators and rewards ------------------------------------------------------------------------

cube, place = Variable("?cube", CUBE), Variable("?place", PLACE)
PICK = operator(
    "Pick",
    [cube],
    needs={atom(HAND_EMPTY), atom(ON_TABLE, cube), atom(IS_CLEAR, cube)},
    adds={atom(HOLDING, cube)},
    deletes={atom(HAND_EMPTY), atom(ON_TABLE, cube)},
)
UNSTACK = operator(
    "Unstack",
    [place, cube],
    needs={atom(HAND_EMPTY), atom(ON, cube, place), atom(IS_CLEAR, cube)},
    adds={atom(HOLDING, cube), atom(IS_CLEAR, place)},
    deletes={atom(HAND_EMPTY), atom(ON, cube, place)},
)
PLACE_ON = operator(
    "Place",
    [cube, place],
    needs={atom(HOLDING, cube), atom(IS_CLEAR, place)},
    adds={atom(HAND_EMPTY), atom(ON, cube, place)},
    deletes={atom(HOLDING, cube), atom(IS_CLEAR, place)},
)
OPERATORS = (PICK, UNSTACK, PLACE_ON)

TO_CUBE = ((DIS_TO_OBJ, 0.4, (cube,)), (XY_DIS, 0.2, (cube,)), (Z_DIS, 0.2, (cube,)))  # LG-SAIL C.2
REWARDS = {
    "Pick": reward(PICK, *TO_CUBE),
    "Unstack": reward(UNSTACK, *TO_CUBE),
    "Place": reward(
        PLACE_ON,
        (PARALLEL_DIS, 0.35, (cube, place)),
        (PERPENDICULAR_DIS, 0.35, (cube, place)),
    ),
}
