# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: types, metrics, predicates, and operators and rewards written by hand."""

from __future__ import annotations

import math

from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.metrics import (
    AXIAL_DIS,
    DIS_TO_OBJ,
    NORM_ANGLE,
    RADIAL_DIS,
    XY_DIS,
    Z_DIS,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import hand_empty, holding, is_clear, on_table
from slap_ros.domains.classifiers import is_a
from slap_ros.relational import Predicate, Type, Variable
from slap_ros.relational.metrics import at_most, within

PEG = Type("peg", THING.features, THING)
HOLE = Type("hole", PLACE.features, PLACE)
TYPES = (PLACE, THING, PEG, HOLE)

# The paper has 50 mm for both distances: by that, a peg on top of a plate is in its hole.
MOST_RADIAL = 0.01  # m
MOST_AXIAL = 0.015  # m, either way
MOST_ANGLE = math.acos(0.95)  # rad

IS_PEG = Predicate("IsPeg", (PLACE,), is_a(PEG), description="its type says so")
IS_HOLE = Predicate("IsHole", (PLACE,), is_a(HOLE), description="its type says so")
HOLDING, ON_TABLE = holding(PEG), on_table(PEG)
HAND_EMPTY = hand_empty(HOLDING)
IN = Predicate.of(
    "In",
    (PEG, HOLE),
    [
        at_most(RADIAL_DIS, MOST_RADIAL),
        within(AXIAL_DIS, -MOST_AXIAL, MOST_AXIAL),
        at_most(NORM_ANGLE, MOST_ANGLE),
    ],
    "held or released",
)
IS_CLEAR = is_clear(IN)
STATIC = frozenset({IS_PEG, IS_HOLE})
PREDICATES = (HAND_EMPTY, HOLDING, ON_TABLE, IN, IS_CLEAR, IS_PEG, IS_HOLE)
METRICS = (RADIAL_DIS, AXIAL_DIS, NORM_ANGLE)

_PEG, _HOLE = Variable("?peg", PEG), Variable("?hole", HOLE)
_EMPTY, _HELD, _LIES = atom(HAND_EMPTY), atom(HOLDING, _PEG), atom(ON_TABLE, _PEG)
_CLEAR, _IN = atom(IS_CLEAR, _HOLE), atom(IN, _PEG, _HOLE)

PICK = operator("Pick", [_PEG], [_EMPTY, _LIES], [_HELD], [_EMPTY, _LIES])
# As printed, Insert does not give HandEmpty back, and no plan is for two pegs.
INSERT = operator("Insert", [_PEG, _HOLE], [_HELD, _CLEAR], [_IN, _EMPTY], [_HELD, _CLEAR])
OPERATORS = (PICK, INSERT)

REWARDS = {
    PICK.name: reward(
        PICK, (DIS_TO_OBJ, 0.4, (_PEG,)), (XY_DIS, 0.2, (_PEG,)), (Z_DIS, 0.2, (_PEG,))
    ),
    # The paper's names are parallel_dis, perpendicular_dis and orientation_diff.
    INSERT.name: reward(
        INSERT,
        (RADIAL_DIS, 0.2, (_PEG, _HOLE)),
        (AXIAL_DIS, 0.2, (_PEG, _HOLE)),
        (NORM_ANGLE, 0.35, (_PEG, _HOLE)),
    ),
}
