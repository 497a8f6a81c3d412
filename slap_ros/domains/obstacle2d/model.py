# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: types, predicates, operators (SLAP, appendix)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.domains.classifiers import always, is_held, strictly
from slap_ros.relational import (
    Column,
    Feature,
    LiftedAtom,
    LiftedOperator,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.predicates import Bools, cache_latest
from slap_ros.relational.state import Array
from slap_ros.tiered_function import TieredFunction

BLOCK_SIZE = 0.2  # m, width and height of every block and of the robot's gripper
OVERLAP_TOLERANCE = 1e-3  # m, how far a block may reach over an area's edge without overlapping it
INSIDE_TOLERANCE = 0.01  # m, how far a block in the target area may reach over its edge
RESTING_TOLERANCE = 1e-6  # m, height over the table at which a block still rests on it
STEEPNESS = 1e6  # 1, of that tolerance in margins: all of it counts as the whole table sideways

X, Y = Feature("x", "m"), Feature("y", "m")
ROBOT = Type("robot", (X, Y))
BLOCK = Type("block", (X, Y, Feature("held", "1")))
SURFACE = Type("surface", (X, Feature("width", "m"), Feature("is_target", "1")))
TYPES = (ROBOT, BLOCK, SURFACE)


# -- predicates ---------------------------------------------------------------------------------


def _is_target(state: State, surface: Column) -> Bools:
    return state.stack(surface, "is_target") > 0.5


def _is_not_target(state: State, surface: Column) -> Bools:
    return state.stack(surface, "is_target") < 0.5


def _rest_margin(state: State, block: Column) -> Array:
    """Positive where the block lies on the table: not held, bottom at the table's top.

    It increases so steeply that the margin of a block at rest is that of the distances sideways.
    """
    height = np.where(state.stack(block, "held") > 0.5, BLOCK_SIZE, state.stack(block, "y"))
    margin = RESTING_TOLERANCE - height
    return np.maximum(margin, STEEPNESS * margin)


class _Relations(NamedTuple):
    """Of each block to each surface; predicates share most of the work."""

    rest: Array  # margin of lying on the table, m, shape (..., blocks)
    distance: Array  # between middles, m, shape (..., blocks, surfaces)
    overlap: Array  # margin, m, shape (..., blocks, surfaces); -1 or less where that is no target
    on_table: Array  # margin of being at rest and off every target area, m, shape (..., blocks)


@cache_latest
def _relations(state: State) -> _Relations:
    """Of a state, or of many, which compiled code may compute: the same bits."""
    if state.data.ndim != 2:
        return relations_by_numpy(state)
    return RELATIONS_OF_MANY.of(len(state.data))(state)


def relations_by_numpy(state: State) -> _Relations:
    """Only target areas can be overlapped; the table is simply what blocks lie on."""
    blocks, surfaces = state.layout.column_of(BLOCK), state.layout.column_of(SURFACE)
    rest = _rest_margin(state, blocks)
    places, middles = state.stack(blocks, "x")[..., None], state.stack(surfaces, "x")
    distance = np.abs(places - middles[..., None, :])
    half_widths = (BLOCK_SIZE + state.stack(surfaces, "width")) / 2
    reach = half_widths[..., None, :] - distance - OVERLAP_TOLERANCE
    reach = np.where(_is_target(state, surfaces)[..., None, :], reach, -1.0)
    overlap = np.minimum(rest[..., None], reach)
    off_targets = strictly(-np.minimum(rest, reach.max(axis=-1)))
    return _Relations(rest, distance, overlap, np.minimum(rest, off_targets))


def _compiled_relations() -> Callable[[State], _Relations]:
    """The relations of many states by compiled code."""
    from slap_ros.domains.obstacle2d import kernels

    tolerances = kernels.RelationConstants(
        BLOCK_SIZE, RESTING_TOLERANCE, OVERLAP_TOLERANCE, STEEPNESS
    )

    def compiled(state: State) -> _Relations:
        layout = state.layout
        blocks, surfaces = layout.column_of(BLOCK), layout.column_of(SURFACE)
        found = kernels.relations(
            np.array(state.data),  # that may be changed: numba compiles for either
            tuple(layout.indices(blocks, name) for name in ("x", "y", "held")),
            tuple(layout.indices(surfaces, name) for name in ("x", "width", "is_target")),
            tolerances,
        )
        return _Relations(*found)

    return compiled


RELATIONS_OF_MANY: TieredFunction[Callable[[State], _Relations]] = TieredFunction(
    relations_by_numpy, _compiled_relations
)


def _numbers(state: State, column: Column, kind: Type) -> NDArray[np.intp]:
    """At which places among the objects of a type those of a column are."""
    cached = column.cached_indices(state.layout)
    if kind not in cached:
        every = state.layout.column_of(kind).objects
        cached[kind] = np.array([every.index(obj) for obj in column.objects], dtype=np.intp)
    return cached[kind]


def _overlap_margin(state: State, block: Column, surface: Column) -> Array:
    of_blocks, of_surfaces = _numbers(state, block, BLOCK), _numbers(state, surface, SURFACE)
    margin: Array = _relations(state).overlap[..., of_blocks, of_surfaces]
    return margin


def _both(one: Array, other: Array) -> Array:
    """The lesser where both are met, else the sum of what is missing of each."""
    missing = np.minimum(one, 0.0) + np.minimum(other, 0.0)
    return np.where(missing < 0.0, missing, np.minimum(one, other))


def _on_margin(tolerance: float, state: State, block: Column, surface: Column) -> Array:
    if state.data.ndim != 2:
        return on_margin_by_numpy(tolerance, state, block, surface)
    return ON_MARGIN_OF_MANY.of(len(state.data))(tolerance, state, block, surface)


def on_margin_by_numpy(tolerance: float, state: State, block: Column, surface: Column) -> Array:
    """On a target area: inside it. On the table: at rest and off every target area.

    Args:
        tolerance: How far a block may reach over the edge of a target area, m.
        state: One state, or a batch.
        block: Blocks.
        surface: Surface for each of them.

    Returns:
        Margins, m, shape (..., blocks).
    """
    known = _relations(state)
    of_blocks, of_surfaces = _numbers(state, block, BLOCK), _numbers(state, surface, SURFACE)
    room = (state.stack(surface, "width") - BLOCK_SIZE) / 2 + tolerance
    distance = known.distance[..., of_blocks, of_surfaces]
    inside = _both(known.rest[..., of_blocks], room - distance)
    return np.where(_is_target(state, surface), inside, known.on_table[..., of_blocks])


def _compiled_on_margin() -> OnMargin:
    """The margins of many states by compiled code."""
    from slap_ros.domains.obstacle2d import kernels

    def compiled(tolerance: float, state: State, block: Column, surface: Column) -> Array:
        known, layout = _relations(state), state.layout
        return kernels.on_margins(
            np.array(state.data),
            (known.rest, known.distance, known.on_table),
            (_numbers(state, block, BLOCK), _numbers(state, surface, SURFACE)),
            (layout.indices(surface, "width"), layout.indices(surface, "is_target")),
            (BLOCK_SIZE, tolerance),
        )

    return compiled


OnMargin = Callable[[float, State, Column, Column], Array]
ON_MARGIN_OF_MANY: TieredFunction[OnMargin] = TieredFunction(
    on_margin_by_numpy, _compiled_on_margin
)


def _clear_margin(state: State, surface: Column) -> Array:
    most = _relations(state).overlap.max(axis=-2)
    return strictly(-most[..., _numbers(state, surface, SURFACE)])


def _gripper_empty(state: State, _: Column) -> Bools:
    held = state.stack(state.layout.column_of(BLOCK), "held")
    empty: Bools = held.max(axis=-1, keepdims=True) < 0.5
    return empty


def on(inside_tolerance: float = INSIDE_TOLERANCE) -> Predicate:
    """On; a block in the target area may reach so far over its edge, m."""
    return Predicate.threshold("On", (BLOCK, SURFACE), partial(_on_margin, inside_tolerance))


IS_ROBOT = Predicate("IsRobot", (ROBOT,), always)
IS_BLOCK = Predicate("IsBlock", (BLOCK,), always)
IS_SURFACE = Predicate("IsSurface", (SURFACE,), always)
IS_TARGET = Predicate("IsTarget", (SURFACE,), _is_target)
NOT_IS_TARGET = Predicate("NotIsTarget", (SURFACE,), _is_not_target)
ON = on()
OVERLAP = Predicate.threshold("Overlap", (BLOCK, SURFACE), _overlap_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), is_held)
GRIPPER_EMPTY = Predicate("GripperEmpty", (ROBOT,), _gripper_empty)
CLEAR = Predicate.threshold("Clear", (SURFACE,), _clear_margin)
PREDICATES = (
    IS_ROBOT,
    IS_BLOCK,
    IS_SURFACE,
    IS_TARGET,
    NOT_IS_TARGET,
    ON,
    OVERLAP,
    HOLDING,
    GRIPPER_EMPTY,
    CLEAR,
)


@lru_cache(maxsize=64)
def predicates(inside_tolerance: float) -> tuple[Predicate, ...]:
    """All of them; equal by name and types to those above, which stand for any tolerance."""
    return tuple(on(inside_tolerance) if p == ON else p for p in PREDICATES)


# -- operators ----------------------------------------------------------------------------------


def _operators() -> tuple[LiftedOperator, ...]:
    robot, block, surface = Variable("?r", ROBOT), Variable("?b", BLOCK), Variable("?s", SURFACE)
    empty = LiftedAtom(GRIPPER_EMPTY, (robot,))
    holding = LiftedAtom(HOLDING, (robot, block))
    on = LiftedAtom(ON, (block, surface))
    overlap = LiftedAtom(OVERLAP, (block, surface))
    clear = LiftedAtom(CLEAR, (surface,))
    kinds = {
        LiftedAtom(IS_ROBOT, (robot,)),
        LiftedAtom(IS_BLOCK, (block,)),
        LiftedAtom(IS_SURFACE, (surface,)),
    }
    table = kinds | {LiftedAtom(NOT_IS_TARGET, (surface,))}
    target = kinds | {LiftedAtom(IS_TARGET, (surface,))}

    def operator(
        name: str, pre: set[LiftedAtom], add: set[LiftedAtom], delete: set[LiftedAtom]
    ) -> LiftedOperator:
        parameters = (robot, block, surface)
        return LiftedOperator(name, parameters, frozenset(pre), frozenset(add), frozenset(delete))

    return (
        operator("Pick", table | {empty, on}, add={holding}, delete={empty, on}),
        operator(
            "PickFromTarget",
            target | {empty, overlap},
            add={holding, clear},
            delete={empty, overlap, on},
        ),
        operator("Place", table | {holding}, add={empty, on}, delete={holding}),
        operator(
            "PlaceInTarget",
            target | {holding, clear},
            add={empty, on, overlap},
            delete={holding, clear},
        ),
    )


OPERATORS = _operators()
