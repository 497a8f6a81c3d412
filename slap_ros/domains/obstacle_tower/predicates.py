# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: predicates (SLAP, appendix). Margins in m; ``support`` says what they mean."""

from __future__ import annotations

from slap_ros.domains.classifiers import always, has_flag, is_held, lacks_flag, none_is_held
from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE, THING
from slap_ros.domains.obstacle_tower.support import support_relations, support_truths
from slap_ros.relational import Column, Predicate, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT


def _on(state: State, block: Column, thing: Column) -> Bools:
    if state.data.ndim > 1:
        return _on_margin(state, block, thing) >= 0.0
    known = support_truths(state)
    return known.on[known.objects.pairs(block, thing)]


def _on_margin(state: State, block: Column, thing: Column) -> Array:
    objects, on, _ = support_relations(state)
    return on.take(objects.pairs(block, thing), axis=-1)


def _nothing_on(state: State, thing: Column) -> Bools:
    if state.data.ndim > 1:
        return _nothing_on_margin(state, thing) >= 0.0
    known = support_truths(state)
    return known.room[known.objects.positions(thing)]


def _nothing_on_margin(state: State, thing: Column) -> Array:
    objects, _, room = support_relations(state)
    return room.take(objects.positions(thing), axis=-1)


def _holding(state: State, robot: Column, block: Column) -> Bools:
    if state.data.ndim > 1:
        return is_held(state, robot, block)
    known = support_truths(state)
    return known.held[known.objects.positions(block)]


def _not_holding(state: State, robot: Column, block: Column) -> Bools:
    return ~_holding(state, robot, block)


def _gripper_empty(state: State, _: Column) -> Bools:
    if state.data.ndim > 1:
        return none_is_held(state, state.layout.column_of(BLOCK))
    return support_truths(state).empty


IS_ROBOT = Predicate("IsRobot", (ROBOT,), always)
IS_BLOCK = Predicate("IsBlock", (BLOCK,), always)
IS_SURFACE = Predicate("IsSurface", (SURFACE,), always)
IS_MOVABLE = Predicate("IsMovable", (THING,), has_flag("is_movable"))
NOT_IS_MOVABLE = Predicate("NotIsMovable", (THING,), lacks_flag("is_movable"))
IS_TARGET = Predicate("IsTarget", (THING,), has_flag("is_target"))
NOT_IS_TARGET = Predicate("NotIsTarget", (THING,), lacks_flag("is_target"))
ON = Predicate("On", (BLOCK, THING), _on, _on_margin)
NOTHING_ON = Predicate("NothingOn", (THING,), _nothing_on, _nothing_on_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), _holding)
NOT_HOLDING = Predicate("NotHolding", (ROBOT, BLOCK), _not_holding)
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
