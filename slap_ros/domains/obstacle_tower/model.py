# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
TINY = float(np.finfo(np.float64).tiny)
STEEPNESS = 50.0  # 1, of tolerances in margins: all of TOUCHING counts as 20 cm sideways

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

Complex = NDArray[np.complex128]


# -- where things lie -----------------------------------------------------------------------------

Indices = NDArray[np.intp]
W, Z, X, Y = range(4)  # parts of a quaternion as they are read: (w, z) and (x, y) turn the plane


def _to_edges() -> Array:
    """The linear map from the products of a quaternion's parts to where a unit cube's edges point.

    Returns:
        Shape (16, 9): x and y of the first, second and third edge, then z of each.
    """
    to = np.zeros((4, 4, 9))
    axes, place = (X, Y, Z), ((0, 2, 4), (1, 3, 5), (6, 7, 8))  # place[coordinate][edge]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        a, b, c = axes[i], axes[j], axes[k]
        to[[a, W, b, c], [a, W, b, c], place[i][i]] = 1.0, 1.0, -1.0, -1.0
        to[a, b, place[i][j]], to[c, W, place[i][j]] = 2.0, -2.0
        to[a, c, place[i][k]], to[b, W, place[i][k]] = 2.0, 2.0
    return to.reshape(16, 9)


TO_EDGES = _to_edges()
HALVES = (*("half_x",) * 2, *("half_y",) * 2, *("half_z",) * 2, "half_x", "half_y", "half_z")


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
            where("qw", "qz", "qx", "qy").T,
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
    touches = _unpinched(TOUCHING - np.abs(gap))

    # It covers what it is over, seen along the axes of that thing.
    places = _complex(data.take(things.places, axis=-1))[..., 0]
    way = places[..., blocks, None] - places[..., None, :]
    back = _turned_back(q, edges)[..., None, :]
    width = _width(_complex(edges[..., :6])[..., None, :], back)
    own_width = np.diagonal(width, axis1=-3, axis2=-2).swapaxes(-1, -2)[..., None, :, :]
    ahead_aside = width[..., blocks, :, :] + own_width - _along_axes(way * back)
    covers = np.minimum(ahead_aside[..., 0], ahead_aside[..., 1])

    # It lies in the middle of a target; elsewhere on the table; or on a part of another block.
    centred = CENTRED - np.abs(way)
    to_target = np.where(is_target[..., None, :], centred, -1.0)[..., things.blocks :]
    elsewhere = _strictly(-np.maximum.reduce(to_target, axis=-1, initial=-1.0))[..., None]
    on_table = np.minimum(covers, elsewhere)
    off_targets = np.where(is_movable[..., None, :], covers, on_table)
    sideways = np.where(is_target[..., None, :], centred, off_targets)
    on = np.minimum(touches, sideways)

    # On the table there is always room; on targets and blocks for one block only.
    over = np.maximum.reduce(np.minimum(touches, covers), axis=-2, initial=-1.0)
    room = np.where(is_movable | is_target, _strictly(-over), 1.0)
    return Lie(things, on.reshape(*on.shape[:-2], -1), room)


def _complex(pairs: Array) -> Complex:
    """Numbers from their parts side by side, without copying."""
    numbers: Complex = pairs.view(np.complex128)
    return numbers


def _along_axes(vectors: Complex) -> Array:
    """How far vectors reach along the axes, shape (..., 2)."""
    return np.abs(vectors[..., None].view(np.float64))


def _turned_back(q: Array, edges: Array) -> Complex:
    """What turns the plane so that things lie along its axes, by their yaw.

    Of the two parts of a quaternion that have to do with the yaw, one is 0 for what lies on its
    bottom, the other for what lies on its head. The larger one is taken.
    """
    parts = _complex(q)
    part: Complex = np.where(edges[..., 8] > 0.0, parts[..., 0], parts[..., 1])
    back: Complex = part.conj() / part
    return back


def _width(edges: Complex, back: Complex) -> Array:
    """How far boxes reach from their centres along turned axes, shape (..., 2)."""
    along = _along_axes(edges * back[..., None])
    width: Array = along[..., 0, :] + along[..., 1, :] + along[..., 2, :]
    return width


def _unpinched(tolerance: Array) -> Array:
    """A tolerance that, where it is kept, leaves a smallest margin to the distances sideways."""
    return np.maximum(tolerance, STEEPNESS * tolerance)


def _strictly(margin: Array) -> Array:
    """Make a negated margin false at 0, where the original still holds."""
    return margin - TINY


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
