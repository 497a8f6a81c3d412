# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.state_access import JOINT_NAMES
from slap_ros.physics.features import (
    BODY_FEATURES,
    MATERIAL_FEATURES,
    POSE_FEATURES,
    ROBOT,
)
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
from slap_ros.relational.predicates import Bools, cache_latest
from slap_ros.relational.state import Array

LOW = 0.03  # height over the table at which a thing still counts as on it
WALL = 0.005  # thickness of the bin's walls
OVER, ASIDE = 0.05, 0.02  # of a hand ready to pick: over the thing's middle, and off it at most
BAND = 0.02  # of OVER, either way
TIP = 0.009  # from between the fingertips to their ends
CLEAR, HAND_CLEAR = 0.03, 0.045  # over everything else: of a block, of the fingers' ends
SLOW = 0.2  # m/s, of what has landed in the bin
SETTLING = 0.1  # s, what makes a speed a margin
BUSY = 0.05  # margin that is missing at least while a hand is full that should be empty

# Of blocks and surfaces alike: a box around the thing in the thing's own frame.
THING_FEATURES = (
    *(Feature(f"half_{axis}", "m") for axis in ("x", "y", "z")),  # half its edges
    *(Feature(f"middle_{axis}", "m") for axis in ("x", "y", "z")),  # its middle
    Feature("is_movable", "1"),
    Feature("is_drawer", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *THING_FEATURES), THING)
TOOL = Type("tool", BLOCK.features, BLOCK)  # the wiper: what is learned with it is not with a toy
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, TOOL, SURFACE)

POSITION = ("x", "y", "z")
TURN = ("qx", "qy", "qz", "qw")
VELOCITY = ("vx", "vy", "vz")
HALF = ("half_x", "half_y", "half_z")
MIDDLE = ("middle_x", "middle_y", "middle_z")
TINY = float(np.finfo(np.float64).tiny)


# -- where everything is --------------------------------------------------------------------------

Indices = NDArray[np.intp]
X, Y, Z, W = range(4)


def _to_up() -> Array:
    """The linear map from the products of a quaternion's parts to how far its axes point up."""
    to = np.zeros((4, 4, 3))
    to[X, Z, 0], to[Y, W, 0] = 2.0, -2.0
    to[Y, Z, 1], to[X, W, 1] = 2.0, 2.0
    to[Z, Z, 2], to[W, W, 2], to[X, X, 2], to[Y, Y, 2] = 1.0, 1.0, -1.0, -1.0
    return to.reshape(16, 3)


TO_UP = _to_up()
SUM = np.ones(3)
BLOCK_READ = (*POSITION, *TURN, *VELOCITY, "held", *HALF, *MIDDLE)
SURFACE_READ = ("x", "y", "qw", "qz", "z", *HALF, "is_drawer")  # complex numbers first


@dataclass(frozen=True, eq=False)
class CleanupObjectIndex:
    """The blocks and surfaces of a layout, and where their features are."""

    blocks: Column
    surfaces: Column
    read: tuple[Indices, Indices]  # (blocks, BLOCK_READ), (surfaces, SURFACE_READ)
    others: Bools  # of each block, shape (blocks, blocks)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> CleanupObjectIndex:
        """Those of a layout."""
        blocks, surfaces = layout.column_of(BLOCK), layout.column_of(SURFACE)
        return CleanupObjectIndex(
            blocks,
            surfaces,
            (layout.grid(blocks, BLOCK_READ), layout.grid(surfaces, SURFACE_READ)),
            ~np.eye(len(blocks.objects), dtype=bool),
        )

    @staticmethod
    @lru_cache(maxsize=4096)
    def numbers(among: Column, column: Column) -> Indices:
        """The objects of a column as numbers among others."""
        return np.array([among.objects.index(obj) for obj in column.objects], dtype=np.intp)


class CleanupRelations(NamedTuple):
    """How everything is in a state, as margins in m."""

    on: Array  # of blocks on surfaces, shape (..., blocks, surfaces)
    above: Array  # of blocks over everything else, shape (..., blocks)
    ready: Array  # of the hand over blocks, shape (..., blocks)
    hand_ready: Array  # shape (...)
    highest: Array  # height of the highest point of what is not in the hand, shape (...)


@cache_latest
def cleanup_relations(state: State) -> CleanupRelations:
    """How everything is: all at once, as predicates share most of it."""
    things = CleanupObjectIndex.of(state.layout)
    blocks, surfaces = (state.data.take(read, axis=-1) for read in things.read)
    bottom, top = _extents(blocks)
    held = blocks[..., 10] > 0.5
    full = np.logical_or.reduce(held, axis=-1)
    # The bin is lower than the table.
    table_top = np.maximum.reduce(surfaces[..., 4] + surfaces[..., 7], axis=-1)

    # What is in the hand is in nobody's way, and need only be higher than what is not.
    tops = np.where(held, -np.inf, top)
    others = np.where(things.others, tops[..., None, :], -np.inf)
    highest_other = np.maximum(np.maximum.reduce(others, axis=-1), table_top[..., None])
    highest = np.maximum(np.maximum.reduce(tops, axis=-1), table_top)

    hand = observation.grasp_points(
        state.gather(state.layout.column_of(ROBOT), JOINT_NAMES)[..., 0, :]
    )
    way = hand[..., None, :] - blocks[..., :3]
    aside = ASIDE - np.hypot(way[..., 0], way[..., 1])
    ready = _all_of(np.stack([aside, BAND - np.abs(way[..., 2] - OVER)]))
    return CleanupRelations(
        _on(blocks, surfaces, bottom, held),
        bottom - highest_other - CLEAR,
        _idle(ready, full[..., None]),
        _idle(hand[..., 2] - TIP - highest - HAND_CLEAR, full),
        highest,
    )


def _extents(blocks: Array) -> tuple[Array, Array]:
    """Heights of the lowest and highest points of the boxes around blocks, shape (..., blocks)."""
    q = blocks[..., 3:7]
    up = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16) @ TO_UP
    middle = blocks[..., 2] + (up * blocks[..., 14:17]) @ SUM
    reach = (np.abs(up) * blocks[..., 11:14]) @ SUM
    return middle - reach, middle + reach


def _on(blocks: Array, surfaces: Array, bottom: Array, held: Bools) -> Array:
    """Blocks are on the table as long as they are low; in the bin when they have landed in it."""
    is_drawer = (surfaces[..., 8] > 0.5)[..., None, :]
    z, half_z = surfaces[..., None, :, 4], surfaces[..., None, :, 7]
    walls = np.where(is_drawer, WALL, 0.0)[..., None]

    # Sideways, vectors are complex numbers: turned by a product.
    pairs = np.ascontiguousarray(surfaces[..., None, :, :4]).view(np.complex128)
    place = np.ascontiguousarray(blocks[..., :2]).view(np.complex128)
    way = (place - pairs[..., 0]) * np.square(pairs[..., 1].conj())
    sideways = surfaces[..., None, :, 5:7] - walls - np.abs(way[..., None].view(np.float64))

    gap = bottom[..., :, None] - z - half_z
    inside = half_z - np.abs(blocks[..., 2, None] - z)
    slow = SETTLING * (SLOW - np.sqrt(np.square(blocks[..., 7:10]) @ SUM))[..., None]
    on = _all_of(
        np.stack(
            [
                sideways[..., 0],
                sideways[..., 1],
                np.where(is_drawer, inside, LOW - np.abs(gap)),
                np.where(is_drawer, slow, np.inf),
            ]
        )
    )
    return _idle(on, is_drawer & held[..., :, None])


def _all_of(margins: Array) -> Array:
    """The least of margins along the first axis; where several are missing, all that is missing.

    So what is pushed towards the bin comes nearer to it even while it is too high.
    """
    missing: Array = np.add.reduce(np.minimum(margins, 0.0), axis=0)
    least: Array = np.minimum.reduce(margins)
    return np.where(missing < 0.0, missing, least)


def _idle(margin: Array, busy: Bools) -> Array:
    """A margin that is missing where a hand is full."""
    return np.where(busy, np.minimum(margin, -BUSY), margin)


def _strictly(margin: Array) -> Array:
    """Make a negated margin false at 0, where the original still holds."""
    return margin - TINY


# -- predicates -----------------------------------------------------------------------------------


def _among_blocks(margins: Array, state: State, block: Column) -> Array:
    return margins.take(
        CleanupObjectIndex.numbers(CleanupObjectIndex.of(state.layout).blocks, block), axis=-1
    )


def _on_margin(state: State, block: Column, surface: Column) -> Array:
    things = CleanupObjectIndex.of(state.layout)
    rows = CleanupObjectIndex.numbers(things.blocks, block)
    margins: Array = cleanup_relations(state).on[
        ..., rows, CleanupObjectIndex.numbers(things.surfaces, surface)
    ]
    return margins


def _above_margin(state: State, block: Column) -> Array:
    return _among_blocks(cleanup_relations(state).above, state, block)


def _not_above_margin(state: State, block: Column) -> Array:
    return _strictly(-_above_margin(state, block))


def _ready_margin(state: State, _: Column, block: Column) -> Array:
    return _among_blocks(cleanup_relations(state).ready, state, block)


def _not_ready_margin(state: State, robot: Column, block: Column) -> Array:
    return _strictly(-_ready_margin(state, robot, block))


def _hand_ready_margin(state: State, _: Column) -> Array:
    return cleanup_relations(state).hand_ready[..., None]


def _is(state: State, thing: Column, label: str) -> Bools:
    return state.stack(thing, label) > 0.5


def _always(state: State, column: Column) -> Bools:
    return np.ones((*state.data.shape[:-1], len(column.objects)), dtype=bool)


def _held(state: State, _: Column, block: Column) -> Bools:
    return _is(state, block, "held")


def _not_held(state: State, _: Column, block: Column) -> Bools:
    return ~_is(state, block, "held")


def _gripper_empty(state: State, _: Column) -> Bools:
    held = _is(state, CleanupObjectIndex.of(state.layout).blocks, "held")
    empty: Bools = ~np.logical_or.reduce(held, axis=-1, keepdims=True)
    return empty


def _label(name: str, kind: Type, label: str, wanted: bool = True) -> Predicate:
    return Predicate(name, (kind,), lambda state, thing: _is(state, thing, label) == wanted)


IS_ROBOT = Predicate("IsRobot", (ROBOT,), _always)
IS_BLOCK = Predicate("IsBlock", (BLOCK,), _always)
IS_TABLE = _label("IsTable", SURFACE, "is_drawer", wanted=False)
IS_DRAWER = _label("IsDrawer", SURFACE, "is_drawer")
IS_MOVABLE = _label("IsMovable", THING, "is_movable")
NOT_IS_MOVABLE = _label("NotIsMovable", THING, "is_movable", wanted=False)
READY_PICK = Predicate.threshold("ReadyPick", (ROBOT, BLOCK), _ready_margin)
NOT_READY_PICK = Predicate.threshold("NotReadyPick", (ROBOT, BLOCK), _not_ready_margin)
ON = Predicate.threshold("On", (BLOCK, SURFACE), _on_margin)
HOLDING = Predicate("Holding", (ROBOT, BLOCK), _held)
NOT_HOLDING = Predicate("NotHolding", (ROBOT, BLOCK), _not_held)
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


# -- operators ------------------------------------------------------------------------------------


def _operators() -> tuple[LiftedOperator, ...]:
    robot, block, surface = Variable("?r", ROBOT), Variable("?b", BLOCK), Variable("?s", SURFACE)

    def of_robot(predicate: Predicate) -> LiftedAtom:
        return LiftedAtom(predicate, (robot,))

    def of_block(predicate: Predicate) -> LiftedAtom:
        return LiftedAtom(predicate, (block,))

    def of_both(predicate: Predicate) -> LiftedAtom:
        return LiftedAtom(predicate, (robot, block))

    def operator(
        name: str,
        where: Predicate,
        needs: set[LiftedAtom],
        adds: set[LiftedAtom],
        deletes: set[LiftedAtom],
    ) -> LiftedOperator:
        kinds = {of_robot(IS_ROBOT), of_block(IS_BLOCK), of_block(IS_MOVABLE)}
        kinds |= {LiftedAtom(where, (surface,)), LiftedAtom(NOT_IS_MOVABLE, (surface,))}
        return LiftedOperator(
            name,
            (robot, block, surface),
            frozenset(kinds | needs | deletes),
            frozenset(adds),
            frozenset(deletes),
        )

    on = LiftedAtom(ON, (block, surface))
    empty = {of_robot(GRIPPER_EMPTY), of_both(NOT_HOLDING)}
    return (
        operator(
            "Reach",
            IS_TABLE,
            {on, *empty},
            {of_both(READY_PICK)},
            {of_robot(HAND_READY_PICK), of_both(NOT_READY_PICK)},
        ),
        operator(
            "Grasp",
            IS_TABLE,
            {on},
            {of_both(HOLDING), of_both(NOT_READY_PICK)},
            {*empty, of_both(READY_PICK)},
        ),
        operator(
            "Lift",
            IS_TABLE,
            {of_both(HOLDING)},
            {of_block(ABOVE_EVERYTHING)},
            {on, of_block(NOT_ABOVE_EVERYTHING)},
        ),
        operator(
            "Drop",
            IS_DRAWER,
            set(),
            {on, *empty, of_robot(HAND_READY_PICK), of_block(NOT_ABOVE_EVERYTHING)},
            {of_both(HOLDING), of_block(ABOVE_EVERYTHING)},
        ),
    )


OPERATORS = _operators()
