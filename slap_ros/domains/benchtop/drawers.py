# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drawers: metrics, predicates, operators and rewards written by hand, and scripts. SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slap_ros.core import Policy, Script
from slap_ros.domains.benchtop.cabinet import CABINET, HANDLE, MIDDLE
from slap_ros.domains.benchtop.features import THING
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, GoalOf, HandGoal
from slap_ros.domains.benchtop.metrics import NEAR_METRES, closure_metric, opening_metric
from slap_ros.domains.benchtop.operators import atom, operator, reward
from slap_ros.domains.benchtop.predicates import DRAWER_OPEN, is_closed, is_open
from slap_ros.domains.benchtop.scripts import Move, follow, hold_still, over, release
from slap_ros.domains.benchtop.state_access import (
    distances,
    hand_position,
    hand_positions,
    in_base,
    position_of,
    positions,
    value,
    yaw_of,
)
from slap_ros.geometry.pose import Vector
from slap_ros.relational import (
    Column,
    LiftedOperator,
    Metric,
    Object,
    Predicate,
    RewardTemplate,
    State,
    Variable,
)
from slap_ros.relational.state import Array
from slap_ros.worlds.features import pose_of

# -- where its parts are --------------------------------------------------------------------------


def in_drawer(state: State, cabinet: Object, point: Vector) -> Vector:
    """Where a point of the drawer is, m.

    Args:
        state: Current state.
        cabinet: Cabinet that has the drawer.
        point: Position of the point in the cabinet's frame while the drawer is closed, m.
    """
    x, y, z = point
    return pose_of(state, cabinet).apply((x, y + value(state, cabinet, "opening"), z))


def handle_of(state: State, cabinet: Object) -> Vector:
    """Where the middle of the bar is, m."""
    return in_drawer(state, cabinet, HANDLE)


def middle_of(state: State, cabinet: Object) -> Vector:
    """The point of the drawer's floor where things go, m."""
    return in_drawer(state, cabinet, MIDDLE)


def in_drawers(state: State, cabinets: Column, point: Vector) -> Array:
    """Where the same point of several drawers is.

    Args:
        state: A state or a batch of states.
        cabinets: Cabinets that have the drawers.
        point: Position of the point in a cabinet's frame while the drawer is closed, m.

    Returns:
        m, shape (..., cabinets, 3).
    """
    x, y, z = point
    opening = state.stack(cabinets, "opening")
    local = np.stack([np.full_like(opening, x), opening + y, np.full_like(opening, z)], axis=-1)
    return in_base(state, cabinets, local)


# -- metrics, all ours ----------------------------------------------------------------------------


def dis_to_handle(state: State, cabinet: Object) -> float:
    """The distance from the point between the fingertips to the middle of the handle."""
    return math.dist(hand_position(state), handle_of(state, cabinet))


def _dis_to_handle(state: State, cabinets: Column) -> Array:
    return distances(in_drawers(state, cabinets, HANDLE), hand_positions(state))


def drawer_dis(state: State, thing: Object, cabinet: Object) -> float:
    """The distance from a thing to the middle of a drawer, however far open, seen from above.

    Args:
        state: A single state.
        thing: Thing that is put into the drawer.
        cabinet: Cabinet that has the drawer.

    Returns:
        m, at least 0.
    """
    return math.dist(position_of(state, thing)[:2], middle_of(state, cabinet)[:2])


def _drawer_dis(state: State, things: Column, cabinets: Column) -> Array:
    middles = in_drawers(state, cabinets, MIDDLE)
    return distances(positions(state, things)[..., :2], middles[..., :2])


DIS_TO_HANDLE = Metric(
    "dis_to_handle",
    (CABINET,),
    "m",
    "Distance from the hand to the drawer's handle.",
    _dis_to_handle,
    dis_to_handle,
    NEAR_METRES,
    of_hand=True,
)
DRAWER_DIS = Metric(
    "drawer_dis",
    (THING, CABINET),
    "m",
    "Horizontal distance from a thing to the middle of the drawer.",
    _drawer_dis,
    drawer_dis,
    NEAR_METRES,
)
OPENING = opening_metric(CABINET, DRAWER_OPEN)
CLOSURE = closure_metric(CABINET)
METRICS = (DIS_TO_HANDLE, DRAWER_DIS, OPENING, CLOSURE)


# -- predicates and operators ---------------------------------------------------------------------

IS_CABINET_OPEN = is_open(CABINET, OPENING)
IS_CABINET_CLOSE = is_closed(CABINET, CLOSURE)


def _free_space(state: State) -> Array:
    """How much less than allowed the widest drawer is open, as the margin of one atom."""
    (closed,) = IS_CABINET_CLOSE.conditions
    margins = closed.margin(state, (state.layout.column_of(CABINET),))
    least: Array = margins.min(axis=-1, keepdims=True)
    return least


HAS_FREE_SPACE = replace(
    Predicate.threshold("HasFreeSpace", (), _free_space),
    description="every drawer is closed, so there is room to pull one open",
)
PREDICATES = (IS_CABINET_OPEN, IS_CABINET_CLOSE, HAS_FREE_SPACE)

C = Variable("?cabinet", CABINET)


def drawer_operators(hand_empty: Predicate) -> tuple[LiftedOperator, LiftedOperator]:
    """Open and Close, as the paper prints them (B.3)."""
    empty, space = atom(hand_empty), atom(HAS_FREE_SPACE)
    closed, opened = atom(IS_CABINET_CLOSE, C), atom(IS_CABINET_OPEN, C)
    return (
        operator("Open", [C], [space, closed, empty], [opened], [space, closed]),
        operator("Close", [C], [opened, empty], [space, closed], [opened]),
    )


def drawer_rewards(opening: LiftedOperator, closing: LiftedOperator) -> tuple[RewardTemplate, ...]:
    """What Open and Close are rewarded for. The paper prints none; the weights are ours."""
    return (
        reward(opening, (DIS_TO_HANDLE, 0.3, (C,)), (OPENING, 0.5, (C,))),
        reward(closing, (DIS_TO_HANDLE, 0.3, (C,)), (CLOSURE, 0.5, (C,))),
    )


# -- scripts --------------------------------------------------------------------------------------

TRAVEL_HEIGHT = 0.2  # of the grasp point: what is held passes over roofs
PULL = 0.01  # in a control step: faster, what lies in the drawer slides
LEAD = 0.03  # by which the hand's goal is ahead of the bar
WIDE, SHUT = 0.145, 0.002  # openings at which scripts are done
GRIP_STEPS = 6  # environment steps that the fingers take to close around the bar


def at_handle(state: State, cabinet: Object) -> HandGoal:
    """Where the hand takes the handle."""
    return HandGoal(handle_of(state, cabinet), yaw_of(state, cabinet))


def ahead_of_handle(cabinet: Object, way: float) -> GoalOf:
    """Where to pull the handle: so far towards y of the bar, wherever that is."""
    x, y, z = HANDLE

    def goal(state: State) -> HandGoal:
        return HandGoal(in_drawer(state, cabinet, (x, y + way, z)), yaw_of(state, cabinet))

    return goal


def open_drawer(state: State, objects: tuple[Object, ...]) -> Policy:
    """Pull a drawer open by its handle."""
    (cabinet,) = objects
    return follow(
        *_to_handle(state, cabinet),
        Move(
            ahead_of_handle(cabinet, LEAD),
            CLOSE,
            until=lambda now: value(now, cabinet, "opening") >= WIDE,
            fastest=PULL,
        ),
    )


def close_drawer(state: State, objects: tuple[Object, ...]) -> Policy:
    """Push a drawer shut by its handle."""
    (cabinet,) = objects
    return follow(
        *_to_handle(state, cabinet),
        Move(
            ahead_of_handle(cabinet, -LEAD),
            CLOSE,
            until=lambda now: value(now, cabinet, "opening") <= SHUT,
            fastest=PULL,
        ),
    )


def _to_handle(state: State, cabinet: Object) -> tuple[Move, ...]:
    """Open the fingers, go to the handle and close them around it."""
    return (
        release(),
        *over(state, at_handle(state, cabinet), OPEN, TRAVEL_HEIGHT),
        Move(lambda now: at_handle(now, cabinet), OPEN),
        hold_still(CLOSE, lambda _: False, patience=GRIP_STEPS),
    )


SCRIPTS: Mapping[str, Script] = {"Open": open_drawer, "Close": close_drawer}
