# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Types, predicates, operators, tasks. Lengths in m; x is to the right, y is up."""

from __future__ import annotations

import numpy as np

from kinder_obstruction.environment import BRIDGE, CONFIG
from slap_ros.core import Task
from slap_ros.relational import (
    Column,
    GroundAtom,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Variable,
)
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

STEP_LIMIT = 300  # environment steps
ROBOT = BRIDGE.type("kin_robot")
BLOCK = BRIDGE.type("dyn_rectangle")
OBSTRUCTION = BRIDGE.type("obstruction")
TARGET = BRIDGE.type("target_block")
SURFACE = BRIDGE.type("target_surface")
TYPES = BRIDGE.types

TABLE = CONFIG.table_height  # y of the table's top, which the surface is a part of
FINGER_ROOM = 0.06  # beside the surface, for the fingers around the block that is put there
BESIDE_ROOM = 0.09  # beside a block, for a finger that comes from above
ON_TOLERANCE = 0.02  # between a block's bottom and the surface; KinDER allows 0.025
LEFTMOST = CONFIG.world_min_x + CONFIG.robot_base_radius + 0.02  # x of the base
RIGHTMOST = CONFIG.world_max_x - CONFIG.robot_base_radius - 0.02
HELD_MARGIN = 0.02  # of what is decided by the hand, not by a distance


def half_extents(state: State, block: Column) -> tuple[Array, Array]:
    """Half of what blocks measure along x and y, turned as they are."""
    half_width, half_height = state.stack(block, "width") / 2, state.stack(block, "height") / 2
    turn = state.stack(block, "theta")
    cos, sin = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    return half_width * cos + half_height * sin, half_width * sin + half_height * cos


def _held(state: State, block: Column) -> Bools:
    held: Bools = state.stack(block, "held") > 0.5
    return held


def _on_margin(state: State, target: Column, surface: Column) -> Array:
    """All of the block's bottom is on the surface, and it stands."""
    half_x, half_y = half_extents(state, target)
    away = np.abs(state.stack(target, "x") - state.stack(surface, "x"))
    inside = state.stack(surface, "width") / 2 - away - half_x
    # Half the sine of twice the angle: how far one corner of an edge of 1 m is above the other.
    tilt = np.abs(np.sin(2.0 * state.stack(target, "theta"))) / 2.0
    above = np.abs(state.stack(target, "y") - half_y - TABLE)
    margin = np.minimum(inside, ON_TOLERANCE - np.maximum(above, tilt * 0.5))
    return np.where(_held(state, target), np.minimum(margin, -HELD_MARGIN), margin)


def _clear_margin(state: State, obstruction: Column, surface: Column) -> Array:
    """The gap between obstruction and surface, beyond what the fingers need."""
    half_x, _ = half_extents(state, obstruction)
    away = np.abs(state.stack(obstruction, "x") - state.stack(surface, "x"))
    margin: Array = away - half_x - state.stack(surface, "width") / 2 - FINGER_ROOM
    return np.where(_held(state, obstruction), np.maximum(margin, HELD_MARGIN), margin)


def _holding(state: State, _: Column, block: Column) -> Bools:
    return _held(state, block)


def _hand_empty(state: State, _: Column) -> Bools:
    empty: Bools = ~_held(state, state.layout.column_of(BLOCK)).any(axis=-1, keepdims=True)
    return empty


ON = Predicate.threshold("On", (TARGET, SURFACE), _on_margin)
CLEAR = Predicate.threshold("Clear", (OBSTRUCTION, SURFACE), _clear_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), _holding)
HAND_EMPTY = Predicate("HandEmpty", (ROBOT,), _hand_empty)
PREDICATES = (ON, CLEAR, HOLDING, HAND_EMPTY)


def _operators() -> tuple[LiftedOperator, ...]:
    robot, surface = Variable("?r", ROBOT), Variable("?s", SURFACE)
    target, obstruction = Variable("?t", TARGET), Variable("?o", OBSTRUCTION)
    empty, clear = LiftedAtom(HAND_EMPTY, (robot,)), LiftedAtom(CLEAR, (obstruction, surface))
    holding_it, holding = (LiftedAtom(HOLDING, (robot, b)) for b in (target, obstruction))
    on = LiftedAtom(ON, (target, surface))
    free, all_of = frozenset({empty}), (robot, target, surface, obstruction)
    return (
        LiftedOperator(
            "PickTarget", (robot, target, surface), free, frozenset({holding_it}), free | {on}
        ),
        LiftedOperator(
            "PlaceTarget",
            all_of,
            frozenset({holding_it, clear}),
            frozenset({empty, on}),
            frozenset({holding_it}),
        ),
        LiftedOperator(
            "PickObstruction",
            (robot, obstruction, surface),
            free,
            frozenset({holding, clear}),
            free,
        ),
        LiftedOperator(
            "PlaceObstruction",
            (robot, obstruction, surface),
            frozenset({holding}),
            frozenset({empty, clear}),
            frozenset({holding}),
        ),
    )


OPERATORS = _operators()


def target_on_surface(state: State) -> frozenset[GroundAtom]:
    """The goal, which is KinDER's."""
    (target,), (surface,) = (state.layout.of_type(t) for t in (TARGET, SURFACE))
    return frozenset({ON(target, surface)})


def can_be_taken(state: State, block: Object) -> bool:
    """Whether base and fingers can be where they must be to take a block from above.

    A finger has to fit on either side, and the base has to stay between the walls.
    """
    left, right = edges(state, block)
    others = [edges(state, o) for o in state.layout.of_type(BLOCK) if o != block]
    room = all(
        left - other_right > BESIDE_ROOM or other_left - right > BESIDE_ROOM
        for other_left, other_right in others
    )
    return room and LEFTMOST < float(state.get(block, "x")) < RIGHTMOST


def edges(state: State, block: Object) -> tuple[float, float]:
    """The x of a block's left and right edge."""
    half = float(half_extents(state, Column((block,)))[0][0])
    x = float(state.get(block, "x"))
    return x - half, x + half


def sample_task(rng: np.random.Generator) -> Task:
    """What KinDER's sampler draws, where the hand can take both blocks."""
    while True:
        state = BRIDGE.sample(int(rng.integers(2**31)))
        if all(can_be_taken(state, block) for block in state.layout.of_type(BLOCK)):
            return Task(state, target_on_surface(state), STEP_LIMIT)
