# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: operators (SLAP, appendix).

A block is picked up from, and put down on, table, target or another block.
"""

from __future__ import annotations

from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.domains.obstacle_tower.predicates import (
    GRIPPER_EMPTY,
    HOLDING,
    IS_BLOCK,
    IS_MOVABLE,
    IS_ROBOT,
    IS_SURFACE,
    IS_TARGET,
    NOT_HOLDING,
    NOT_IS_MOVABLE,
    NOT_IS_TARGET,
    NOTHING_ON,
    ON,
)
from slap_ros.relational import LiftedAtom, LiftedOperator, Predicate, Variable
from slap_ros.worlds.joint_space.features import ROBOT

ROBOT_VARIABLE, BLOCK_VARIABLE = Variable("?r", ROBOT), Variable("?b", BLOCK)
TABLE, TARGET = Variable("?s", SURFACE), Variable("?t", SURFACE)
OTHER_BLOCK = Variable("?o", BLOCK)

EMPTY = LiftedAtom(GRIPPER_EMPTY, (ROBOT_VARIABLE,))
HOLDS = LiftedAtom(HOLDING, (ROBOT_VARIABLE, BLOCK_VARIABLE))
HOLDS_NOT = LiftedAtom(NOT_HOLDING, (ROBOT_VARIABLE, BLOCK_VARIABLE))
KINDS = {
    LiftedAtom(IS_ROBOT, (ROBOT_VARIABLE,)),
    LiftedAtom(IS_BLOCK, (BLOCK_VARIABLE,)),
    LiftedAtom(IS_MOVABLE, (BLOCK_VARIABLE,)),
}


def _all_hold(thing: Variable, *predicates: Predicate) -> set[LiftedAtom]:
    return {LiftedAtom(predicate, (thing,)) for predicate in predicates}


# What says that a thing is the table, a target, or a block.
KINDS_OF_THING = {
    TABLE: _all_hold(TABLE, IS_SURFACE, NOT_IS_MOVABLE, NOT_IS_TARGET),
    TARGET: _all_hold(TARGET, IS_SURFACE, NOT_IS_MOVABLE, IS_TARGET),
    OTHER_BLOCK: _all_hold(OTHER_BLOCK, IS_BLOCK, IS_MOVABLE, NOT_IS_TARGET),
}


def _room_on(thing: Variable) -> set[LiftedAtom]:
    """What a block takes up on a thing: nothing on the table, where there always is room."""
    return set() if thing == TABLE else _all_hold(thing, NOTHING_ON)


def _pick(name: str, thing: Variable) -> LiftedOperator:
    """Take a block off a thing."""
    on = LiftedAtom(ON, (BLOCK_VARIABLE, thing))
    needs = {EMPTY, HOLDS_NOT, on, *_all_hold(BLOCK_VARIABLE, NOTHING_ON)}
    return LiftedOperator(
        name,
        (ROBOT_VARIABLE, BLOCK_VARIABLE, thing),
        frozenset(KINDS | KINDS_OF_THING[thing] | needs),
        frozenset({HOLDS} | _room_on(thing)),
        frozenset({EMPTY, HOLDS_NOT, on}),
    )


def _place(name: str, thing: Variable) -> LiftedOperator:
    """Put the held block on a thing."""
    return LiftedOperator(
        name,
        (ROBOT_VARIABLE, BLOCK_VARIABLE, thing),
        frozenset(KINDS | KINDS_OF_THING[thing] | {HOLDS} | _room_on(thing)),
        frozenset({EMPTY, HOLDS_NOT, LiftedAtom(ON, (BLOCK_VARIABLE, thing))}),
        frozenset({HOLDS} | _room_on(thing)),
    )


OPERATORS = (
    _pick("Pick", TABLE),
    _pick("PickFromTarget", TARGET),
    _pick("Unstack", OTHER_BLOCK),
    _place("Place", TABLE),
    _place("PlaceInTarget", TARGET),
    _place("Stack", OTHER_BLOCK),
)
