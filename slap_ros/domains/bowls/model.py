# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: types, metrics of their own, predicates; operators and rewards written by hand."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.benchtop import predicates
from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.metrics import (
    FULL_LIFT,
    IS_GRASPED,
    NEAR_METRES,
    PARALLEL_DIS,
    PERPENDICULAR_DIS,
)
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import LIFTED, LYING
from slap_ros.domains.benchtop.state_access import (
    axes,
    hand_position,
    hand_positions,
    position_of,
    positions,
    value,
)
from slap_ros.relational import (
    Column,
    Feature,
    Metric,
    NormalisedForm,
    Object,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.metrics import at_least, is_true, within
from slap_ros.relational.state import Array
from slap_ros.worlds.features import pose_of

HALVES = ("half_length", "half_width")  # along x and y
SIZES = tuple(Feature(name, "m") for name in HALVES)
RIM = (Feature("rim_radius", "m"), Feature("rim_height", "m"))  # where a bowl is grasped

# A surface's frame is the middle of where things stand on it. What stands there is on the table as
# well, so to say; what stands on the plate is not. All of a bowl has to leave a surface before the
# table is below it: a bowl that is pushed over an edge is not lifted by that.
SURFACE = Type("surface", (*PLACE.features, *SIZES), PLACE)
PLATE = Type("plate", PLACE.features, PLACE)
BOWL = Type("bowl", (*THING.features, *RIM), THING)
TYPES = (PLACE, THING, SURFACE, PLATE, BOWL)


# -- metrics --------------------------------------------------------------------------------------


def rim_dis(state: State, bowl: Object) -> float:
    """From the point between the fingertips to the nearest point of an upright bowl's rim."""
    (x, y, z), (u, v, w) = hand_position(state), position_of(state, bowl)
    outside = math.hypot(x - u, y - v) - value(state, bowl, "rim_radius")
    return math.hypot(outside, z - (w + value(state, bowl, "rim_height")))


def _rim_dis(state: State, bowls: Column) -> Array:
    x, y, z = np.moveaxis(hand_positions(state) - positions(state, bowls), -1, 0)
    outside = np.hypot(x, y) - state.stack(bowls, "rim_radius")
    distances: Array = np.hypot(outside, z - state.stack(bowls, "rim_height"))
    return distances


def rise(state: State, bowl: Object) -> float:
    """The height of the bowl's underside over the table, or over a surface that it is over."""
    x, y, z = position_of(state, bowl)
    radius, top = value(state, bowl, "rim_radius"), 0.0
    for surface in state.layout.of_type(SURFACE):
        dx, dy, _ = pose_of(state, surface).inverse().apply((x, y, z))
        length, width = value(state, surface, "half_length"), value(state, surface, "half_width")
        if math.hypot(max(abs(dx) - length, 0.0), max(abs(dy) - width, 0.0)) <= radius:
            top = max(top, value(state, surface, "z"))
    return z - value(state, bowl, "rest_height") - top


def _rise(state: State, bowls: Column) -> Array:
    surfaces = state.layout.column_of(SURFACE)
    apart = positions(state, bowls)[..., :, None, :] - positions(state, surfaces)[..., None, :, :]
    along, up = axes(state, surfaces)[..., None, :, :], np.array([0.0, 0.0, 1.0])
    dx, dy = (np.abs((apart * axis).sum(axis=-1)) for axis in (along, np.cross(up, along)))
    radius = state.stack(bowls, "rim_radius")[..., :, None]
    length, width = (state.stack(surfaces, name)[..., None, :] for name in HALVES)
    beside = np.hypot(np.maximum(dx - length, 0.0), np.maximum(dy - width, 0.0))
    heights = np.where(beside <= radius, state.stack(surfaces, "z")[..., None, :], 0.0)
    gap = state.stack(bowls, "z") - state.stack(bowls, "rest_height")
    highest: Array = heights.max(axis=-1, initial=0.0)
    return gap - highest


RIM_DIS = Metric(
    "rim_dis",
    (BOWL,),
    "m",
    "Distance from the hand to the bowl's rim.",
    _rim_dis,
    rim_dis,
    NEAR_METRES,
    of_hand=True,
)
RISE = Metric(
    "rise",
    (BOWL,),
    "m",
    "Height of the bowl's underside over the table, or over a surface that it is over.",
    _rise,
    rise,
    NormalisedForm.fraction(FULL_LIFT),
)
METRICS = (RIM_DIS, RISE)


# -- predicates -----------------------------------------------------------------------------------

HOLDING = Predicate.of("Holding", (BOWL,), [is_true(IS_GRASPED), at_least(RISE, LIFTED)])
HAND_EMPTY = predicates.hand_empty(HOLDING)
ON_TABLE = Predicate.of(
    "OnTable", (BOWL,), [within(RISE, -LYING, LYING)], "surfaces count as the table"
)
# Nearer to the middle than cubes have to be: with 10 mm, random motions and a hand that opens as it
# goes down put a bowl on the plate in nearly a tenth of all trials.
ON = predicates.on(BOWL, PLATE, radius=0.007)
IS_CLEAR = predicates.is_clear(predicates.over(BOWL, PLATE))
PREDICATES = (HAND_EMPTY, HOLDING, ON_TABLE, ON, IS_CLEAR)

# Where a bowl can be at first, by the number in its name and that of the goal.
SPOTS = (
    "between the plate and the ramekin",
    "next to the ramekin",
    "in the middle of the table",
    "on the cookie box",
    "in the tray",
    "on the ramekin",
    "next to the cookie box",
    "on the stove",
    "next to the plate",
    "on the cabinet",
)
GOALS = {f"task{number}": goal((ON, f"bowl{number}", "plate")) for number in range(len(SPOTS))}


# -- operators and rewards ------------------------------------------------------------------------

bowl, plate = Variable("?bowl", BOWL), Variable("?plate", PLATE)
PICK = operator(
    "Pick",
    [bowl],
    needs={atom(HAND_EMPTY), atom(ON_TABLE, bowl)},
    adds={atom(HOLDING, bowl)},
    deletes={atom(HAND_EMPTY), atom(ON_TABLE, bowl)},
)
PLACE_ON = operator(
    "Place",
    [bowl, plate],
    needs={atom(HOLDING, bowl), atom(IS_CLEAR, plate)},
    adds={atom(HAND_EMPTY), atom(ON, bowl, plate)},
    deletes={atom(HOLDING, bowl), atom(IS_CLEAR, plate)},
)
OPERATORS = (PICK, PLACE_ON)

REWARDS = {
    # The paper's Pick leads the hand to the middle of a thing, where a bowl cannot be grasped.
    "Pick": reward(PICK, (RIM_DIS, 0.6, (bowl,)), (RISE, 0.2, (bowl,))),
    "Place": reward(
        PLACE_ON,
        (PARALLEL_DIS, 0.35, (bowl, plate)),
        (PERPENDICULAR_DIS, 0.35, (bowl, plate)),
    ),
}
