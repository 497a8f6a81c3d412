# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE, THING
from slap_ros.domains.obstacle_tower.support import support_relations, support_truths
from slap_ros.physics.features import ROBOT
from slap_ros.relational import (
    Column,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

TYPES = (ROBOT, THING, BLOCK, SURFACE)

# -- predicates -----------------------------------------------------------------------------------


def _on(state: State, block: Column, thing: Column) -> Bools:
    if state.data.ndim > 1:
        return _on_margin(state, block, thing) >= 0.0
    known = support_truths(state)
    return known.on[known.things.pairs(block, thing)]


def _on_margin(state: State, block: Column, thing: Column) -> Array:
    things, on, _ = support_relations(state)
    return on.take(things.pairs(block, thing), axis=-1)


def _nothing_on(state: State, thing: Column) -> Bools:
    if state.data.ndim > 1:
        return _nothing_on_margin(state, thing) >= 0.0
    known = support_truths(state)
    return known.room[known.things.numbers(thing)]


def _nothing_on_margin(state: State, thing: Column) -> Array:
    things, _, room = support_relations(state)
    return room.take(things.numbers(thing), axis=-1)


@lru_cache(maxsize=256)
def _all(layout: Layout, kind: Type) -> Column:
    """Every object of a type."""
    return Column(layout.of_type(kind))


def _is(state: State, thing: Column, label: str) -> Bools:
    return state.stack(thing, label) > 0.5


def _always(state: State, column: Column) -> Bools:
    return np.ones((*state.data.shape[:-1], len(column.objects)), dtype=bool)


def _held(state: State, _: Column, block: Column) -> Bools:
    if state.data.ndim > 1:
        return _is(state, block, "held")
    known = support_truths(state)
    return known.held[known.things.numbers(block)]


def _not_held(state: State, robot: Column, block: Column) -> Bools:
    return ~_held(state, robot, block)


def _gripper_empty(state: State, _: Column) -> Bools:
    if state.data.ndim == 1:
        return support_truths(state).empty
    held = _is(state, _all(state.layout, BLOCK), "held")
    empty: Bools = ~np.logical_or.reduce(held, axis=-1, keepdims=True)
    return empty


def _label(name: str, label: str) -> Predicate:
    return Predicate(name, (THING,), lambda state, thing: _is(state, thing, label))


def _not_label(name: str, label: str) -> Predicate:
    return Predicate(name, (THING,), lambda state, thing: ~_is(state, thing, label))


IS_ROBOT = Predicate("IsRobot", (ROBOT,), _always)
IS_BLOCK = Predicate("IsBlock", (BLOCK,), _always)
IS_SURFACE = Predicate("IsSurface", (SURFACE,), _always)
IS_MOVABLE = _label("IsMovable", "is_movable")
NOT_IS_MOVABLE = _not_label("NotIsMovable", "is_movable")
IS_TARGET = _label("IsTarget", "is_target")
NOT_IS_TARGET = _not_label("NotIsTarget", "is_target")
ON = Predicate("On", (BLOCK, THING), _on, _on_margin)
NOTHING_ON = Predicate("NothingOn", (THING,), _nothing_on, _nothing_on_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), _held)
NOT_HOLDING = Predicate("NotHolding", (ROBOT, BLOCK), _not_held)
GRIPPER_EMPTY = Predicate("GripperEmpty", (ROBOT,), _gripper_empty)
PREDICATES = (
    IS_ROBOT,
    IS_BLOCK,
    IS_SURFACE,
    IS_MOVABLE,
    NOT_IS_MOVABLE,
    IS_TARGET,
    NOT_IS_TARGET,
    ON,
    NOTHING_ON,
    HOLDING,
    NOT_HOLDING,
    GRIPPER_EMPTY,
)


# -- operators ------------------------------------------------------------------------------------


def _operators() -> tuple[LiftedOperator, ...]:
    robot, block = Variable("?r", ROBOT), Variable("?b", BLOCK)
    table, target, other = Variable("?s", SURFACE), Variable("?t", SURFACE), Variable("?o", BLOCK)
    empty = LiftedAtom(GRIPPER_EMPTY, (robot,))
    holding = LiftedAtom(HOLDING, (robot, block))
    not_holding = LiftedAtom(NOT_HOLDING, (robot, block))
    kinds = {LiftedAtom(IS_ROBOT, (robot,)), LiftedAtom(IS_BLOCK, (block,))}
    kinds |= {LiftedAtom(IS_MOVABLE, (block,))}

    def is_a(predicate: Predicate, thing: Variable) -> LiftedAtom:
        return LiftedAtom(predicate, (thing,))

    def pick(name: str, thing: Variable, where: set[LiftedAtom], frees: bool) -> LiftedOperator:
        on = LiftedAtom(ON, (block, thing))
        return LiftedOperator(
            name,
            (robot, block, thing),
            frozenset(kinds | where | {empty, not_holding, on, is_a(NOTHING_ON, block)}),
            frozenset({holding} | ({is_a(NOTHING_ON, thing)} if frees else set())),
            frozenset({empty, not_holding, on}),
        )

    def place(name: str, thing: Variable, where: set[LiftedAtom], fills: bool) -> LiftedOperator:
        room = {is_a(NOTHING_ON, thing)} if fills else set()
        return LiftedOperator(
            name,
            (robot, block, thing),
            frozenset(kinds | where | {holding} | room),
            frozenset({empty, not_holding, LiftedAtom(ON, (block, thing))}),
            frozenset({holding} | room),
        )

    on_table = {is_a(p, table) for p in (IS_SURFACE, NOT_IS_MOVABLE, NOT_IS_TARGET)}
    on_target = {is_a(p, target) for p in (IS_SURFACE, NOT_IS_MOVABLE, IS_TARGET)}
    on_block = {is_a(p, other) for p in (IS_BLOCK, IS_MOVABLE, NOT_IS_TARGET)}
    return (
        pick("Pick", table, on_table, frees=False),
        pick("PickFromTarget", target, on_target, frees=True),
        pick("Unstack", other, on_block, frees=True),
        place("Place", table, on_table, fills=False),
        place("PlaceInTarget", target, on_target, fills=True),
        place("Stack", other, on_block, fills=True),
    )


OPERATORS = _operators()
