# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slap_ros.physics.features import BODY_FEATURES, POSE_FEATURES, ROBOT
from slap_ros.relational import (
    Column,
    Feature,
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

TOUCHING = 0.004  # m, height over a thing at which a block still lies on it
CENTRED = 0.015  # m, distance from the target's middle at which a block still is in it

# Of blocks and surfaces alike, so that predicates can ask both at once.
THING_FEATURES = (
    *(Feature(f"half_{axis}", "m") for axis in ("x", "y", "z")),  # half its edges
    Feature("is_movable", "1"),
    Feature("is_target", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *THING_FEATURES), THING)
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, SURFACE)


# -- metrics: shapes are (..., atoms), or (..., blocks, things) for all pairs ---------------------


class Boxes(NamedTuple):
    """Boxes side by side, as arrays that broadcast against those of other boxes."""

    centre: Array  # m, (3, ..., boxes)
    edges: Array  # half its edges, m: coordinate, edge, and then as above, (3, 3, ..., boxes)
    turn: Array  # cosine and sine of its yaw, (2, ..., boxes)

    @classmethod
    def of(cls, state: State, column: Column) -> Boxes:
        """The boxes of a column, along the last axis."""
        centre = np.stack([state.stack(column, axis) for axis in ("x", "y", "z")])
        half = np.stack([state.stack(column, f"half_{axis}") for axis in ("x", "y", "z")])
        q = np.stack([state.stack(column, f"q{part}") for part in ("x", "y", "z", "w")])
        products = q[:, None] * q
        rotation = np.tensordot(TO_ROTATION, products, axes=([2, 3], [0, 1]))
        turn = np.stack([products[3, 3] - products[2, 2], 2.0 * products[2, 3]]) / (
            products[3, 3] + products[2, 2] + np.finfo(np.float64).tiny
        )
        return cls(centre, rotation * half, turn)

    def along(self, axis: int) -> Boxes:
        """The same with a new axis in every array, for pairs of boxes."""
        return Boxes(*(np.expand_dims(array, axis) for array in self))

    @property
    def height(self) -> Array:
        """How far they reach up, and down, from their centres."""
        height: Array = np.abs(self.edges[2]).sum(axis=0)
        return height

    def width(self, cos: Array, sin: Array) -> Array:
        """How far they reach from their centres along a horizontal unit vector."""
        width: Array = np.abs(self.edges[0] * cos + self.edges[1] * sin).sum(axis=0)
        return width


def _to_rotation() -> Array:
    """The linear map from products of a quaternion's parts, x y z w, to a rotation matrix."""
    to = np.zeros((3, 3, 4, 4))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        to[i, i, [i, 3, j, k], [i, 3, j, k]] = 1.0, 1.0, -1.0, -1.0
        to[i, j, i, j], to[i, j, k, 3] = 2.0, -2.0
        to[i, k, i, k], to[i, k, j, 3] = 2.0, 2.0
    return to


TO_ROTATION = _to_rotation()


def _touches(block: Boxes, thing: Boxes) -> Array:
    """Positive where the block's lowest point is at the height of the thing's highest."""
    gap = block.centre[2] - block.height - thing.centre[2] - thing.height
    touches: Array = TOUCHING - np.abs(gap)
    return touches


def _covers(block: Boxes, thing: Boxes) -> Array:
    """Positive where the block is over part of the thing, seen along the thing's axes."""
    dx, dy = block.centre[0] - thing.centre[0], block.centre[1] - thing.centre[1]
    cos, sin = thing.turn
    ahead = thing.width(cos, sin) + block.width(cos, sin) - np.abs(cos * dx + sin * dy)
    aside = thing.width(-sin, cos) + block.width(-sin, cos) - np.abs(cos * dy - sin * dx)
    covers: Array = np.minimum(ahead, aside)
    return covers


def _centred(block: Boxes, target: Boxes) -> Array:
    """Positive where the block's centre is over the middle of the target."""
    dx, dy = block.centre[0] - target.centre[0], block.centre[1] - target.centre[1]
    centred: Array = CENTRED - np.hypot(dx, dy)
    return centred


def _strictly(margin: Array) -> Array:
    """Make a negated margin false at 0, where the original still holds."""
    return margin - np.finfo(np.float64).tiny


# -- predicates -----------------------------------------------------------------------------------


def _on_margin(state: State, block: Column, thing: Column) -> Array:
    """In the middle of the target; elsewhere on the table; or over part of another block."""
    blocks, things = Boxes.of(state, block), Boxes.of(state, thing)
    targets = Boxes.of(state, _all(state.layout, SURFACE))
    is_target = _is(state, _all(state.layout, SURFACE), "is_target")
    in_targets = np.where(
        is_target[..., None, :], _centred(blocks.along(-1), targets.along(-2)), -1.0
    )
    elsewhere = _strictly(-in_targets.max(axis=-1))
    covers = _covers(blocks, things)
    on_table = np.minimum(covers, elsewhere)
    on_others = np.where(_is(state, thing, "is_movable"), covers, on_table)
    centred = _centred(blocks, things)
    sideways = np.where(_is(state, thing, "is_target"), centred, on_others)
    return np.minimum(_touches(blocks, things), sideways)


def _nothing_on_margin(state: State, thing: Column) -> Array:
    """On the table there is always room; on targets and blocks for one block only."""
    blocks = Boxes.of(state, _all(state.layout, BLOCK)).along(-1)
    things = Boxes.of(state, thing).along(-2)
    over = np.minimum(_touches(blocks, things), _covers(blocks, things)).max(axis=-2)
    for_one = _is(state, thing, "is_movable") | _is(state, thing, "is_target")
    return np.where(for_one, _strictly(-over), 1.0)


@lru_cache(maxsize=256)
def _all(layout: Layout, kind: Type) -> Column:
    """Every object of a type."""
    return Column(layout.of_type(kind))


def _is(state: State, thing: Column, label: str) -> Bools:
    return state.stack(thing, label) > 0.5


def _always(state: State, column: Column) -> Bools:
    return np.ones((*state.data.shape[:-1], len(column.objects)), dtype=bool)


def _held(state: State, _: Column, block: Column) -> Bools:
    return _is(state, block, "held")


def _not_held(state: State, _: Column, block: Column) -> Bools:
    return ~_is(state, block, "held")


def _gripper_empty(state: State, _: Column) -> Bools:
    held = state.stack(_all(state.layout, BLOCK), "held")
    empty: Bools = held.max(axis=-1, keepdims=True) < 0.5
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
ON = Predicate.threshold("On", (BLOCK, THING), _on_margin)
NOTHING_ON = Predicate.threshold("NothingOn", (THING,), _nothing_on_margin)
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
