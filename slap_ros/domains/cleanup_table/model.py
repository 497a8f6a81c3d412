# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: types, predicates, operators (SLAP Table 9). Lengths in m, base frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, arm_frames
from slap_ros.physics.features import (
    BODY_FEATURES,
    JOINT_FEATURES,
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
from slap_ros.relational.predicates import Bools, shared
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
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, SURFACE)

POSITION = ("x", "y", "z")
TURN = ("qx", "qy", "qz", "qw")
VELOCITY = ("vx", "vy", "vz")
HALF = ("half_x", "half_y", "half_z")
MIDDLE = ("middle_x", "middle_y", "middle_z")
JOINTS = tuple(feature.name for feature in JOINT_FEATURES)
GRASP = np.array((*GRASP_IN_LAST_LINK.position, 1.0))
TINY = float(np.finfo(np.float64).tiny)

Indices = NDArray[np.intp]


# -- where everything is --------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Things:
    """The blocks and surfaces of a layout, by their numbers."""

    blocks: Column
    surfaces: Column

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> Things:
        """Those of a layout."""
        return Things(layout.column_of(BLOCK), layout.column_of(SURFACE))

    @staticmethod
    @lru_cache(maxsize=4096)
    def numbers(among: Column, column: Column) -> Indices:
        """The objects of a column as numbers among others."""
        return np.array([among.objects.index(obj) for obj in column.objects], dtype=np.intp)


class Scenery(NamedTuple):
    """How everything is in a state, as margins in m."""

    on: Array  # of blocks on surfaces, shape (..., blocks, surfaces)
    above: Array  # of blocks over everything else, shape (..., blocks)
    ready: Array  # of the hand over blocks, shape (..., blocks)
    hand_ready: Array  # shape (...)
    highest: Array  # height of the highest point of what is not in the hand, shape (...)


@shared
def scenery(state: State) -> Scenery:
    """How everything is: all at once, as predicates share most of it."""
    things = Things.of(state.layout)
    place, bottom, top = _extents(state, things.blocks)
    held = state.stack(things.blocks, "held") > 0.5
    full = np.logical_or.reduce(held, axis=-1)
    table_top = _table_top(state, things.surfaces)

    # What is in the hand is in nobody's way, and need only be higher than what is not.
    tops = np.where(held, -np.inf, top)
    others = np.where(np.eye(held.shape[-1], dtype=bool), -np.inf, tops[..., None, :])
    highest_other = np.maximum(np.maximum.reduce(others, axis=-1), table_top[..., None])
    highest = np.maximum(np.maximum.reduce(tops, axis=-1), table_top)

    hand = grasp_point(state)
    way = hand[..., None, :] - place
    aside = ASIDE - np.sqrt(np.square(way[..., :2]).sum(axis=-1))
    ready = _all_of(aside, BAND - np.abs(way[..., 2] - OVER))
    return Scenery(
        _on(state, things, place, bottom, held),
        bottom - highest_other - CLEAR,
        _idle(ready, full[..., None]),
        _idle(hand[..., 2] - TIP - highest - HAND_CLEAR, full),
        highest,
    )


def grasp_point(state: State) -> Array:
    """The point between the fingertips, shape (..., 3)."""
    joints = state.gather(state.layout.column_of(ROBOT), JOINTS)[..., 0, :]
    frames = arm_frames(joints.reshape(-1, len(JOINTS)))[:, -1]
    point: Array = (frames @ GRASP)[:, :3]
    return point.reshape(*joints.shape[:-1], 3)


def _extents(state: State, blocks: Column) -> tuple[Array, Array, Array]:
    """Blocks' origins, shape (..., blocks, 3), and heights of their lowest and highest points."""
    place = state.gather(blocks, POSITION)
    x, y, z, w = np.moveaxis(state.gather(blocks, TURN), -1, 0)
    up = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1)
    middle = place[..., 2] + (up * state.gather(blocks, MIDDLE)).sum(axis=-1)
    reach = (np.abs(up) * state.gather(blocks, HALF)).sum(axis=-1)
    return place, middle - reach, middle + reach


def _table_top(state: State, surfaces: Column) -> Array:
    """Height of the highest surface: the bin is lower than the table."""
    top: Array = np.maximum.reduce(
        state.stack(surfaces, "z") + state.stack(surfaces, "half_z"), axis=-1
    )
    return top


def _on(state: State, things: Things, place: Array, bottom: Array, held: Bools) -> Array:
    """Blocks are on the table as long as they are low; in the bin when they have landed in it."""
    surfaces = things.surfaces
    middle, half = state.gather(surfaces, POSITION), state.gather(surfaces, HALF)
    sin, cos = state.stack(surfaces, "qz"), state.stack(surfaces, "qw")
    sin, cos = 2 * sin * cos, cos * cos - sin * sin
    way = place[..., :, None, :] - middle[..., None, :, :]
    along = cos[..., None, :] * way[..., 0] + sin[..., None, :] * way[..., 1]
    across = cos[..., None, :] * way[..., 1] - sin[..., None, :] * way[..., 0]
    is_drawer = (state.stack(surfaces, "is_drawer") > 0.5)[..., None, :]
    room = np.where(is_drawer, WALL, 0.0)
    covers = (
        half[..., None, :, 0] - room - np.abs(along),
        half[..., None, :, 1] - room - np.abs(across),
    )
    gap = bottom[..., :, None] - (middle + half)[..., None, :, 2]
    inside = half[..., None, :, 2] - np.abs(way[..., 2])
    speed = np.sqrt(np.square(state.gather(things.blocks, VELOCITY)).sum(axis=-1))
    slow = np.broadcast_to(SETTLING * (SLOW - speed)[..., None], gap.shape)
    on_table = _all_of(*covers, LOW - np.abs(gap))
    in_bin = _idle(_all_of(*covers, inside, slow), held[..., :, None])
    return np.where(is_drawer, in_bin, on_table)


def _all_of(*margins: Array) -> Array:
    """The least of some margins; where several are missing, all that is missing.

    So what is pushed towards the bin comes nearer to it even while it is too high.
    """
    parts = np.stack(margins)
    missing = np.minimum(parts, 0.0).sum(axis=0)
    together: Array = np.where(missing < 0.0, missing, np.minimum.reduce(parts))
    return together


def _idle(margin: Array, busy: Bools) -> Array:
    """A margin that is missing where a hand is full."""
    return np.where(busy, np.minimum(margin, -BUSY), margin)


def _strictly(margin: Array) -> Array:
    """Make a negated margin false at 0, where the original still holds."""
    return margin - TINY


# -- predicates -----------------------------------------------------------------------------------


def _among_blocks(margins: Array, state: State, block: Column) -> Array:
    return margins.take(Things.numbers(Things.of(state.layout).blocks, block), axis=-1)


def _on_margin(state: State, block: Column, surface: Column) -> Array:
    things = Things.of(state.layout)
    rows = Things.numbers(things.blocks, block)
    margins: Array = scenery(state).on[..., rows, Things.numbers(things.surfaces, surface)]
    return margins


def _above_margin(state: State, block: Column) -> Array:
    return _among_blocks(scenery(state).above, state, block)


def _not_above_margin(state: State, block: Column) -> Array:
    return _strictly(-_above_margin(state, block))


def _ready_margin(state: State, _: Column, block: Column) -> Array:
    return _among_blocks(scenery(state).ready, state, block)


def _not_ready_margin(state: State, robot: Column, block: Column) -> Array:
    return _strictly(-_ready_margin(state, robot, block))


def _hand_ready_margin(state: State, _: Column) -> Array:
    return scenery(state).hand_ready[..., None]


def _is(state: State, thing: Column, label: str) -> Bools:
    return state.stack(thing, label) > 0.5


def _always(state: State, column: Column) -> Bools:
    return np.ones((*state.data.shape[:-1], len(column.objects)), dtype=bool)


def _held(state: State, _: Column, block: Column) -> Bools:
    return _is(state, block, "held")


def _not_held(state: State, _: Column, block: Column) -> Bools:
    return ~_is(state, block, "held")


def _gripper_empty(state: State, _: Column) -> Bools:
    held = _is(state, Things.of(state.layout).blocks, "held")
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
