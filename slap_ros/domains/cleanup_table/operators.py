# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: operators (SLAP, appendix): Reach, Grasp and Lift a block, Drop it in the bin."""

from __future__ import annotations

from slap_ros.domains.cleanup_table.features import BLOCK, SURFACE
from slap_ros.domains.cleanup_table.predicates import (
    ABOVE_EVERYTHING,
    GRIPPER_EMPTY,
    HAND_READY_PICK,
    HOLDING,
    IS_BLOCK,
    IS_DRAWER,
    IS_MOVABLE,
    IS_ROBOT,
    IS_TABLE,
    NOT_ABOVE_EVERYTHING,
    NOT_HOLDING,
    NOT_IS_MOVABLE,
    NOT_READY_PICK,
    ON,
    READY_PICK,
)
from slap_ros.relational import LiftedAtom, LiftedOperator, Predicate, Variable
from slap_ros.worlds.joint_space.features import ROBOT

ROBOT_VARIABLE, BLOCK_VARIABLE = Variable("?r", ROBOT), Variable("?b", BLOCK)
SURFACE_VARIABLE = Variable("?s", SURFACE)


def _of_robot(predicate: Predicate) -> LiftedAtom:
    return LiftedAtom(predicate, (ROBOT_VARIABLE,))


def _of_block(predicate: Predicate) -> LiftedAtom:
    return LiftedAtom(predicate, (BLOCK_VARIABLE,))


def _of_both(predicate: Predicate) -> LiftedAtom:
    return LiftedAtom(predicate, (ROBOT_VARIABLE, BLOCK_VARIABLE))


ON_SURFACE = LiftedAtom(ON, (BLOCK_VARIABLE, SURFACE_VARIABLE))
EMPTY = {_of_robot(GRIPPER_EMPTY), _of_both(NOT_HOLDING)}


def _operator(
    name: str,
    surface: Predicate,
    needs: set[LiftedAtom],
    adds: set[LiftedAtom],
    deletes: set[LiftedAtom],
) -> LiftedOperator:
    """An operator on a block and a surface of some kind; what it deletes, it needs."""
    kinds = {_of_robot(IS_ROBOT), _of_block(IS_BLOCK), _of_block(IS_MOVABLE)}
    kinds |= {LiftedAtom(p, (SURFACE_VARIABLE,)) for p in (surface, NOT_IS_MOVABLE)}
    return LiftedOperator(
        name,
        (ROBOT_VARIABLE, BLOCK_VARIABLE, SURFACE_VARIABLE),
        frozenset(kinds | needs | deletes),
        frozenset(adds),
        frozenset(deletes),
    )


REACH = _operator(
    "Reach",
    IS_TABLE,
    needs={ON_SURFACE, *EMPTY},
    adds={_of_both(READY_PICK)},
    deletes={_of_robot(HAND_READY_PICK), _of_both(NOT_READY_PICK)},
)
GRASP = _operator(
    "Grasp",
    IS_TABLE,
    needs={ON_SURFACE},
    adds={_of_both(HOLDING), _of_both(NOT_READY_PICK)},
    deletes={*EMPTY, _of_both(READY_PICK)},
)
LIFT = _operator(
    "Lift",
    IS_TABLE,
    needs={_of_both(HOLDING)},
    adds={_of_block(ABOVE_EVERYTHING)},
    deletes={ON_SURFACE, _of_block(NOT_ABOVE_EVERYTHING)},
)
DROP = _operator(
    "Drop",
    IS_DRAWER,
    needs=set(),
    adds={ON_SURFACE, *EMPTY, _of_robot(HAND_READY_PICK), _of_block(NOT_ABOVE_EVERYTHING)},
    deletes={_of_both(HOLDING), _of_block(ABOVE_EVERYTHING)},
)
OPERATORS = (REACH, GRASP, LIFT, DROP)
