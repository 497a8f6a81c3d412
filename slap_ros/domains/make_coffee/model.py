# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make Coffee: metrics of the lid, predicates, operators and rewards. Lengths in m.

The holder and its lid are one object, the holder: whether a pod can go into it depends on its lid,
and an operator can say so without naming a third object.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.cabinet import CABINET
from slap_ros.domains.benchtop.drawers import C
from slap_ros.domains.benchtop.features import DRAWER, LID, PLACE, THING
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.metrics import (
    DIS_TO_OBJ,
    NEAR_METRES,
    NEAR_RADIANS,
    PARALLEL_DIS,
    PERPENDICULAR_DIS,
    XY_DIS,
    Z_DIS,
    closure_metric,
    opening_metric,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import (
    hand_empty,
    holding,
    is_clear,
    is_closed,
    on,
)
from slap_ros.domains.benchtop.state_access import (
    QUATERNION,
    distances,
    hand_position,
    hand_positions,
    in_base,
    value,
)
from slap_ros.domains.make_coffee.scenery import HINGE, HOLDER, LID_LENGTH, POD, lid_pose
from slap_ros.relational import Column, Metric, Object, Predicate, State, Variable
from slap_ros.relational.metrics import at_least, at_most, within
from slap_ros.relational.state import Array
from slap_ros.worlds.features import pose_of

TYPES = (PLACE, THING, DRAWER, LID, POD, CABINET, HOLDER)
INSERTED = 0.006  # between the axes of pod and holder, whose walls leave 4 mm to each side
INSIDE = 0.07  # from the middle of the drawer, whose walls leave a pod less
LIFTED_OUT = 0.02  # over the drawer's floor
UPRIGHT = math.radians(15.0)  # a pod that leans more catches on the walls of the holder
LID_OPEN, LID_CLOSED = math.radians(60.0), math.radians(5.0)


# -- metrics --------------------------------------------------------------------------------------


def dis_to_lid(state: State, holder: Object) -> float:
    """The distance from the point between the fingertips to the middle of the lid's free edge."""
    lid = lid_pose(pose_of(state, holder), value(state, holder, "opening"))
    return math.dist(hand_position(state), lid.apply((-LID_LENGTH, 0.0, 0.0)))


def _dis_to_lid(state: State, holders: Column) -> Array:
    opening, (ahead, aside, up) = state.stack(holders, "opening"), HINGE
    x, z = ahead - LID_LENGTH * np.cos(opening), up + LID_LENGTH * np.sin(opening)
    edges = in_base(state, holders, np.stack([x, np.full_like(x, aside), z], axis=-1))
    return distances(edges, hand_positions(state))


DIS_TO_LID = Metric(
    "dis_to_lid",
    (HOLDER,),
    "m",
    "Distance from the hand to the free edge of the holder's lid.",
    _dis_to_lid,
    dis_to_lid,
    NEAR_METRES,
    of_hand=True,
)


def tilt(state: State, pod: Object) -> float:
    """The angle between a pod's axis and the vertical."""
    return float(_tilt(state, Column.of(pod))[0])


def _tilt(state: State, pods: Column) -> Array:
    x, y, _, _ = np.moveaxis(state.gather(pods, QUATERNION), -1, 0)
    angles: Array = np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))
    return angles


TILT = Metric(
    "tilt", (POD,), "rad", "Angle between the pod's axis and upright.", _tilt, tilt, NEAR_RADIANS
)
LID_OPENING = opening_metric(HOLDER, LID_OPEN, "lid_opening")
LID_CLOSURE = closure_metric(HOLDER, "lid_closure")
METRICS = (*drawers.METRICS, DIS_TO_LID, LID_OPENING, LID_CLOSURE, TILT)


# -- predicates -----------------------------------------------------------------------------------

# A pod that leans in the hand cannot be inserted, so it is not what Insert is to begin with.
HOLDING = Predicate.of("Holding", (POD,), [*holding(POD).conditions, at_most(TILT, UPRIGHT)])
HAND_EMPTY = hand_empty(HOLDING)
# Until it is lifted out: what is grasped in the drawer and let go again is still there. A drawer
# that is pulled by jerks tips its pod over, and is not opened by that.
IN_CABINET = Predicate.of(
    "InCabinet",
    (POD, CABINET),
    [
        at_most(drawers.DRAWER_DIS, INSIDE),
        within(PERPENDICULAR_DIS, -LIFTED_OUT, LIFTED_OUT),
        at_most(TILT, UPRIGHT),
    ],
)
IN = on(POD, HOLDER, "In", INSERTED)
IS_EMPTY = is_clear(IN, "IsEmpty")
IS_LID_OPEN = Predicate.of("IsLidOpen", (HOLDER,), [at_least(LID_OPENING, LID_OPEN)])
IS_LID_CLOSE = is_closed(HOLDER, LID_CLOSURE, "IsLidClose", LID_CLOSED)
PREDICATES = (
    HAND_EMPTY,
    HOLDING,
    IN_CABINET,
    IN,
    IS_EMPTY,
    IS_LID_OPEN,
    IS_LID_CLOSE,
    *drawers.PREDICATES,
)


# -- operators and rewards ------------------------------------------------------------------------

P, H = Variable("?pod", POD), Variable("?holder", HOLDER)
OPEN, CLOSE = drawers.drawer_operators(HAND_EMPTY)
PICK = operator(
    "Pick",
    [C, P],
    needs=[atom(HAND_EMPTY), atom(IN_CABINET, P, C), atom(drawers.IS_CABINET_OPEN, C)],
    adds=[atom(HOLDING, P)],
    deletes=[atom(HAND_EMPTY), atom(IN_CABINET, P, C)],
)
INSERT = operator(
    "Insert",
    [P, H],
    needs=[atom(HOLDING, P), atom(IS_EMPTY, H), atom(IS_LID_OPEN, H)],
    adds=[atom(HAND_EMPTY), atom(IN, P, H)],
    deletes=[atom(HOLDING, P), atom(IS_EMPTY, H)],
)
CLOSE_LID = operator(
    "CloseLid",
    [H],
    needs=[atom(HAND_EMPTY), atom(IS_LID_OPEN, H)],
    adds=[atom(IS_LID_CLOSE, H)],
    deletes=[atom(IS_LID_OPEN, H)],
)
OPERATORS = (OPEN, PICK, INSERT, CLOSE_LID, CLOSE)
REWARDS = (
    *drawers.drawer_rewards(OPEN, CLOSE),
    reward(PICK, (DIS_TO_OBJ, 0.4, (P,)), (XY_DIS, 0.2, (P,)), (Z_DIS, 0.2, (P,))),
    # A pod is round and stands, so what Insert has for the angle goes to the distances.
    reward(INSERT, (PARALLEL_DIS, 0.35, (P, H)), (PERPENDICULAR_DIS, 0.35, (P, H))),
    reward(CLOSE_LID, (DIS_TO_LID, 0.3, (H,)), (LID_CLOSURE, 0.5, (H,))),
)

GOALS = {
    "training": goal(
        (IN, "pod", "holder"),
        (IS_LID_CLOSE, "holder"),
        (drawers.IS_CABINET_CLOSE, "cabinet"),
    ),
}
