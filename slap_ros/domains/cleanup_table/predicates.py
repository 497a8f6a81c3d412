# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: predicates (SLAP, appendix). Margins in m."""

from __future__ import annotations

from slap_ros.domains.classifiers import (
    always,
    has_flag,
    is_held,
    is_not_held,
    lacks_flag,
    none_is_held,
    strictly,
)
from slap_ros.domains.cleanup_table.features import BLOCK, SURFACE, THING, CleanupObjectIndex
from slap_ros.domains.cleanup_table.relations import cleanup_relations
from slap_ros.relational import Column, Predicate, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT


def _of_blocks(margins: Array, state: State, block: Column) -> Array:
    """The margins of some of the blocks."""
    index = CleanupObjectIndex.of(state.layout)
    return margins.take(index.positions(index.blocks, block), axis=-1)


def _on_margin(state: State, block: Column, surface: Column) -> Array:
    index = CleanupObjectIndex.of(state.layout)
    rows = index.positions(index.blocks, block)
    columns = index.positions(index.surfaces, surface)
    margins: Array = cleanup_relations(state).on[..., rows, columns]
    return margins


def _above_margin(state: State, block: Column) -> Array:
    return _of_blocks(cleanup_relations(state).above, state, block)


def _not_above_margin(state: State, block: Column) -> Array:
    return strictly(-_above_margin(state, block))


def _ready_margin(state: State, _: Column, block: Column) -> Array:
    return _of_blocks(cleanup_relations(state).ready, state, block)


def _not_ready_margin(state: State, robot: Column, block: Column) -> Array:
    return strictly(-_ready_margin(state, robot, block))


def _hand_ready_margin(state: State, _: Column) -> Array:
    return cleanup_relations(state).hand_ready[..., None]


def _gripper_empty(state: State, _: Column) -> Bools:
    return none_is_held(state, state.layout.column_of(BLOCK))


IS_ROBOT = Predicate("IsRobot", (ROBOT,), always)
IS_BLOCK = Predicate("IsBlock", (BLOCK,), always)
IS_TABLE = Predicate("IsTable", (SURFACE,), lacks_flag("is_drawer"))
IS_DRAWER = Predicate("IsDrawer", (SURFACE,), has_flag("is_drawer"))
IS_MOVABLE = Predicate("IsMovable", (THING,), has_flag("is_movable"))
NOT_IS_MOVABLE = Predicate("NotIsMovable", (THING,), lacks_flag("is_movable"))
READY_PICK = Predicate.threshold("ReadyPick", (ROBOT, BLOCK), _ready_margin)
NOT_READY_PICK = Predicate.threshold("NotReadyPick", (ROBOT, BLOCK), _not_ready_margin)
ON = Predicate.threshold("On", (BLOCK, SURFACE), _on_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), is_held)
NOT_HOLDING = Predicate("NotHolding", (ROBOT, BLOCK), is_not_held)
GRIPPER_EMPTY = Predicate("GripperEmpty", (ROBOT,), _gripper_empty)
HAND_READY_PICK = Predicate.threshold("HandReadyPick", (ROBOT,), _hand_ready_margin)
ABOVE_EVERYTHING = Predicate.threshold("AboveEverything", (BLOCK,), _above_margin)
NOT_ABOVE_EVERYTHING = Predicate.threshold("NotAboveEverything", (BLOCK,), _not_above_margin)
PREDICATES = (
    IS_ROBOT,
    IS_BLOCK,
    IS_TABLE,
    IS_DRAWER,
    IS_MOVABLE,
    NOT_IS_MOVABLE,
    READY_PICK,
    NOT_READY_PICK,
    ON,
    HOLDING,
    NOT_HOLDING,
    GRIPPER_EMPTY,
    HAND_READY_PICK,
    ABOVE_EVERYTHING,
    NOT_ABOVE_EVERYTHING,
)
