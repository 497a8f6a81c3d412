# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stow Hammer: predicates, operators and rewards as the paper prints them. Lengths in m.

Only one drawer may be open at a time: the paper's HasFreeSpace. A hammer in a drawer goes with it,
so InCabinet is about the drawer and not about the cabinet's frame, and says nothing of speeds.
"""

from __future__ import annotations

from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.cabinet import CABINET
from slap_ros.domains.benchtop.drawers import C
from slap_ros.domains.benchtop.features import DRAWER, PLACE, THING
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.metrics import (
    DIS_TO_OBJ,
    NORM_ANGLE,
    PERPENDICULAR_DIS,
    XY_DIS,
    Z_DIS,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import TOUCHING, hand_empty, holding, on_table
from slap_ros.domains.stow_hammer.scenery import HAMMER
from slap_ros.relational import Predicate, Variable
from slap_ros.relational.metrics import at_most, within

TYPES = (PLACE, THING, DRAWER, HAMMER, CABINET)
STOWED = 0.015  # from the middle of the drawer, at most
ACROSS = 0.2  # rad, from lying along the front, at most

HOLDING = holding(HAMMER)
HAND_EMPTY = hand_empty(HOLDING)
ON_TABLE = on_table(HAMMER)
IN_CABINET = Predicate.of(
    "InCabinet",
    (HAMMER, CABINET),
    [
        at_most(drawers.DRAWER_DIS, STOWED),
        within(PERPENDICULAR_DIS, -TOUCHING, TOUCHING),
        at_most(NORM_ANGLE, ACROSS),
    ],
)
PREDICATES = (HAND_EMPTY, HOLDING, ON_TABLE, IN_CABINET, *drawers.PREDICATES)

H = Variable("?hammer", HAMMER)
OPEN, CLOSE = drawers.drawer_operators(HAND_EMPTY)
PICK = operator(
    "Pick",
    [H],
    needs=[atom(HAND_EMPTY), atom(ON_TABLE, H)],
    adds=[atom(HOLDING, H)],
    deletes=[atom(HAND_EMPTY), atom(ON_TABLE, H)],
)
PLACE_HAMMER = operator(
    "Place",
    [H, C],
    needs=[atom(HOLDING, H), atom(drawers.IS_CABINET_OPEN, C)],
    adds=[atom(HAND_EMPTY), atom(IN_CABINET, H, C)],
    deletes=[atom(HOLDING, H)],
)
OPERATORS = (OPEN, PICK, PLACE_HAMMER, CLOSE)
REWARDS = (
    *drawers.drawer_rewards(OPEN, CLOSE),
    reward(PICK, (DIS_TO_OBJ, 0.4, (H,)), (XY_DIS, 0.2, (H,)), (Z_DIS, 0.2, (H,))),
    # The angle is ours: a hammer must lie along the front.
    reward(
        PLACE_HAMMER,
        (drawers.DRAWER_DIS, 0.35, (H, C)),
        (PERPENDICULAR_DIS, 0.35, (H, C)),
        (NORM_ANGLE, 0.2, (H, C)),
    ),
)

GOALS = {
    "training": goal(
        (IN_CABINET, "hammer0", "cabinet0"),
        (IN_CABINET, "hammer1", "cabinet1"),
        (drawers.IS_CABINET_CLOSE, "cabinet0"),
        (drawers.IS_CABINET_CLOSE, "cabinet1"),
    ),
    "test1": goal(
        (IN_CABINET, "hammer1", "cabinet0"),
        (IN_CABINET, "hammer0", "cabinet1"),
        (drawers.IS_CABINET_CLOSE, "cabinet0"),
        (drawers.IS_CABINET_CLOSE, "cabinet1"),
    ),
    "test2": goal(
        (IN_CABINET, "hammer1", "cabinet0"),
        (drawers.IS_CABINET_OPEN, "cabinet1"),
    ),
}
