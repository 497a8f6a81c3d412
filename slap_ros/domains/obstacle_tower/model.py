# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slap_ros.domains.tabletop.lying import (
    HALVES,
    PARTS,
    TO_EDGES,
    Indices,
    along_axes,
    complex_of,
    strictly,
    turned_back,
    unpinched,
    widths,
)
from slap_ros.physics.features import BODY_FEATURES, MATERIAL_FEATURES, POSE_FEATURES, ROBOT
from slap_ros.relational import (
    Column,
    Feature,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.predicates import Bools, shared
from slap_ros.relational.state import Array

TOUCHING = 0.004  # m, height over a thing at which a block still lies on it
CENTRED = 0.015  # m, distance from the target's middle at which a block still is in it
MOST_REMEMBERED = 1024  # columns of objects, a layout

# Of blocks and surfaces alike, so that predicates can ask both at once.
THING_FEATURES = (
    *(Feature(f"half_{axis}", "m") for axis in ("x", "y", "z")),  # half its edges
    Feature("is_movable", "1"),
    Feature("is_target", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *THING_FEATURES), THING)
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, SURFACE)

# -- where things lie -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Things:
    """The blocks, then the surfaces of a layout, and where their features are."""

    blocks: int  # how many
    objects: tuple[Object, ...]
    quaternions: Indices  # (things, 4), parts as read
    places: Indices  # (things, 2): x, y
    halves: Indices  # (things, 9), as in TO_EDGES
    z: Indices  # (things,), as those that follow
    is_movable: Indices
    is_target: Indices
    _numbers: dict[Column, Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> Things:
        """Those of a layout."""
        blocks = layout.of_type(BLOCK)
        objects = (*blocks, *layout.of_type(SURFACE))

        def where(*features: str) -> Indices:
            return np.array([layout.columns(objects, name) for name in features])

        return Things(
            len(blocks),
            objects,
            where(*PARTS).T,
            where("x", "y").T,
            where(*HALVES).T,
            *where("z", "is_movable", "is_target"),
        )

    def numbers(self, column: Column) -> Indices:
        """The objects of a column as numbers."""
        numbers = self._numbers.get(column)
        if numbers is None:
            numbers = np.array([self.objects.index(obj) for obj in column.objects])
            if len(self._numbers) == MOST_REMEMBERED:
                self._numbers.clear()
            self._numbers[column] = numbers
        return numbers


class Lie(NamedTuple):
    """How everything lies in a state, as margins in m."""

    things: Things
    on: Array  # of blocks on things, shape (..., blocks * things)
    room: Array  # for a block on things, shape (..., things)


@shared
def lie(state: State) -> Lie:
    """How everything lies: all at once, as predicates share most of it.

    Horizontal vectors are complex numbers: turned by a product, seen along both axes at once.
    """
    things, data = Things.of(state.layout), state.data
    blocks = slice(things.blocks)
    q = data.take(things.quaternions, axis=-1)
    products = (q[..., None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    edges = products @ TO_EDGES * data.take(things.halves, axis=-1)
    is_movable = data.take(things.is_movable, axis=-1) > 0.5
    is_target = data.take(things.is_target, axis=-1) > 0.5

    # A block touches what its lowest point is at the height of.
    z, height = data.take(things.z, axis=-1), np.add.reduce(np.abs(edges[..., 6:]), axis=-1)
    gap = (z - height)[..., blocks, None] - (z + height)[..., None, :]
    touches = unpinched(TOUCHING - np.abs(gap))

    # It covers what it is over, seen along the axes of that thing.
    places = complex_of(data.take(things.places, axis=-1))[..., 0]
    way = places[..., blocks, None] - places[..., None, :]
    back = turned_back(q, edges)[..., None, :]
    width = widths(complex_of(edges[..., :6])[..., None, :], back)
    own_width = np.diagonal(width, axis1=-3, axis2=-2).swapaxes(-1, -2)[..., None, :, :]
    ahead_aside = width[..., blocks, :, :] + own_width - along_axes(way * back)
    covers = np.minimum(ahead_aside[..., 0], ahead_aside[..., 1])

    # It lies in the middle of a target; elsewhere on the table; or on a part of another block.
    centred = CENTRED - np.abs(way)
    to_target = np.where(is_target[..., None, :], centred, -1.0)[..., things.blocks :]
    elsewhere = strictly(-np.maximum.reduce(to_target, axis=-1, initial=-1.0))[..., None]
    on_table = np.minimum(covers, elsewhere)
    off_targets = np.where(is_movable[..., None, :], covers, on_table)
    sideways = np.where(is_target[..., None, :], centred, off_targets)
    on = np.minimum(touches, sideways)

    # On the table there is always room; on targets and blocks for one block only.
    over = np.maximum.reduce(np.minimum(touches, covers), axis=-2, initial=-1.0)
    room = np.where(is_movable | is_target, strictly(-over), 1.0)
    return Lie(things, on.reshape(*on.shape[:-2], -1), room)


# -- predicates -----------------------------------------------------------------------------------


def _on_margin(state: State, block: Column, thing: Column) -> Array:
    things, on, _ = lie(state)
    return on.take(things.numbers(block) * len(things.objects) + things.numbers(thing), axis=-1)


def _nothing_on_margin(state: State, thing: Column) -> Array:
    things, _, room = lie(state)
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
    return _is(state, block, "held")


def _not_held(state: State, _: Column, block: Column) -> Bools:
    return ~_is(state, block, "held")


def _gripper_empty(state: State, _: Column) -> Bools:
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
