# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: types, predicates, operators (SLAP Table 9). Lengths in m, base frame.

Sides are those of the target block, named as the robot in front of the drawer sees them: its front
is the face that looks most towards the robot (-x), its left the one that looks most to +y.

The paper names the predicates and operators, but says little of what they mean. We want operators
whose effects are exactly what their skills bring about, without conditional effects:

- A block *blocks* a side where it is in the way of a finger there. That is so only while the
  target block stands in the drawer: else taking it out would change atoms about blocks that the
  operator cannot name. For the same reason nothing is said of the sides of other blocks.
- A block that was just lifted off still blocks; it does no longer once it is put down elsewhere.
  So it is Place{Front,Back,Left,Right}Block that clears the side.
- Who takes the target block out from between two blockers frees it of both: they are parameters
  of GraspFrontBack and GraspLeftRight. GraspFullClear needs none.
- Blockers go elsewhere in the drawer. A shortcut that only pushes them aside so reaches the same
  abstract state as skills do.
- The hand is ready to pick a block when it is over it, and HandReadyPick when it is over none: then
  it may be sent to any. Grasping a block ends that it is over it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from slap_ros.domains.tabletop.footprints import (
    HALVES,
    PARTS,
    TO_EDGES,
    Complex,
    Indices,
    along_axes,
    complex_of,
    strictly,
    turned_back,
    unpinched,
    widths,
)
from slap_ros.domains.tabletop.observation import grasp_points
from slap_ros.domains.tabletop.state_access import HALF_NAMES, JOINT_NAMES
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
from slap_ros.relational.predicates import Bools, Classifier, Margin, cache_latest
from slap_ros.relational.state import Array

TOUCHING = 0.004  # height over a surface at which a block still lies on it
OVER = 0.05  # height of the grasp point over the middle of a block that it is ready to pick
OVER_TOLERANCE = 0.02  # up and down
ASIDE_TOLERANCE = 0.015  # sideways
CACHE_SIZE = 1024  # columns of objects, a layout

SIZE_FEATURES = tuple(Feature(name, "m") for name in HALF_NAMES)  # half its edges
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *SIZE_FEATURES), THING)
TARGET = Type("target_block", BLOCK.features, BLOCK)
SURFACE = Type("surface", (*POSE_FEATURES, *SIZE_FEATURES), THING)
TABLE = Type("table", SURFACE.features, SURFACE)
DRAWER = Type("drawer", SURFACE.features, SURFACE)  # its floor
WALL = Type("wall", (*POSE_FEATURES, *SIZE_FEATURES))  # of the drawer; no predicate asks for it
TYPES = (ROBOT, THING, BLOCK, TARGET, SURFACE, TABLE, DRAWER, WALL)

SIDES = ("Front", "Back", "Left", "Right")
TOWARDS = np.array([-1.0, 1.0, 1.0j, -1.0j])  # each side, seen from a block that is not turned
AXES = np.array([0, 0, 1, 1])  # along which they lie


@dataclass(frozen=True)
class FingerClearance:
    """What has to be free at a side of the target block, so that a finger fits there.

    Args:
        reach: How far from its face. A finger that is open ends 4.2 cm from it.
        half_width: To each side of the middle. A finger is 2.1 cm wide.
    """

    reach: float = 0.048
    half_width: float = 0.016


@dataclass(frozen=True, eq=False)
class DrawerObjectIndex:
    """The blocks and surfaces of a layout, and where their features are."""

    blocks: tuple[Object, ...]
    targets: tuple[Object, ...]
    surfaces: tuple[Object, ...]
    quaternions: Indices  # (blocks, 4), parts as in PARTS
    places: Indices  # (blocks, 2): x, y
    halves: Indices  # (blocks, 9), as in TO_EDGES
    z: Indices  # (blocks,)
    middles: Indices  # (surfaces, 2): x, y
    levels: Indices  # (surfaces, 4): z and half the edges
    is_drawer: Bools  # (surfaces,)
    joints: Indices  # (7,)
    which: Indices  # (targets,): of the blocks
    same: Bools  # (blocks, targets)
    _numbers: dict[tuple[Column, ...], Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> DrawerObjectIndex:
        """Those of a layout."""
        blocks, surfaces = layout.of_type(BLOCK), layout.of_type(SURFACE)
        targets = layout.of_type(TARGET)

        def where(objects: Sequence[Object], *features: str) -> Indices:
            return np.array([layout.columns(objects, name) for name in features]).T

        return DrawerObjectIndex(
            blocks,
            targets,
            surfaces,
            where(blocks, *PARTS),
            where(blocks, "x", "y"),
            where(blocks, *HALVES),
            layout.columns(blocks, "z"),
            where(surfaces, "x", "y"),
            where(surfaces, "z", *HALF_NAMES),
            np.array([surface.type.is_a(DRAWER) for surface in surfaces]),
            where(layout.of_type(ROBOT), *JOINT_NAMES).reshape(-1),
            np.array([blocks.index(target) for target in targets], dtype=np.intp),
            np.array([[block == target for target in targets] for block in blocks]),
        )

    def target_numbers(self, column: Column) -> Indices:
        """Target blocks as numbers among these."""
        return self.numbers(column, column) % max(len(self.targets), 1)

    def numbers(self, *columns: Column) -> Indices:
        """Blocks as numbers; of blocks beside surfaces or targets, the number of the pair."""
        numbers = self._numbers.get(columns)
        if numbers is None:
            first, *others = columns
            numbers = np.array([self.blocks.index(obj) for obj in first.objects])
            for column in others:
                kind = column.objects[0].type
                among = self.targets if kind.is_a(TARGET) else self.surfaces
                second = np.array([among.index(obj) for obj in column.objects])
                numbers = numbers * len(among) + second
            if len(self._numbers) == CACHE_SIZE:
                self._numbers.clear()
            self._numbers[columns] = numbers
        return numbers


# -- margins --------------------------------------------------------------------------------------


class BlockingRelations(NamedTuple):
    """How everything lies in a state, as margins in m."""

    things: DrawerObjectIndex
    on: Array  # of blocks on surfaces, shape (..., blocks * surfaces)
    blocking: Array  # of blocks at sides of target blocks, shape (..., sides, blocks * targets)
    clear: Array  # of these sides, shape (..., sides, targets)


class ClearanceBoxes(NamedTuple):
    """The rooms for fingers at all sides, seen along the faces of the block that they are at."""

    depth: float  # half the reach
    halves: Array  # half their edges, shape (sides, 1, 1, 2)
    spans: Array  # from |cos| and |sin| of a turn to half their spans then, (sides, 1, 2, 2)

    @staticmethod
    @lru_cache(maxsize=64)
    def of(room: FingerClearance) -> ClearanceBoxes:
        """Those that have to be so large."""
        depth = room.reach / 2
        ahead, aside = (depth, room.half_width), (room.half_width, depth)
        halves = np.array([aside if side.imag else ahead for side in TOWARDS])
        spans = np.stack([halves, halves[:, ::-1]], axis=-1)
        return ClearanceBoxes(depth, halves[:, None, None], spans[:, None])


class Blocks(NamedTuple):
    """The blocks of a state. Horizontal vectors are complex numbers: turned by a product."""

    q: Array  # parts of their quaternions, shape (..., blocks, 4)
    edges: Array  # shape (..., blocks, 9), as in TO_EDGES
    flat: Complex  # their edges seen from above, shape (..., blocks, 3)
    places: Complex  # shape (..., blocks), as those that follow
    z: Array
    height: Array  # half of it


def _blocks(things: DrawerObjectIndex, data: Array) -> Blocks:
    q = data.take(things.quaternions, axis=-1)
    products = (q[..., None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    edges = products @ TO_EDGES * data.take(things.halves, axis=-1)
    height = np.add.reduce(np.abs(edges[..., 6:]), axis=-1)
    places = complex_of(data.take(things.places, axis=-1))[..., 0]
    z = data.take(things.z, axis=-1)
    return Blocks(q, edges, complex_of(edges[..., :6]), places, z, height)


def blocking_relations(room: FingerClearance, state: State) -> BlockingRelations:
    """How everything lies, all at once, with so much room for a finger."""
    things, data = DrawerObjectIndex.of(state.layout), state.data
    blocks = _blocks(things, data)
    on = _lying_on(things, data, blocks)
    sideways = _sideways(ClearanceBoxes.of(room), things, blocks)

    # A block blocks at the height of a target block that stands in the drawer.
    z, height = blocks.z, blocks.height
    off_level = np.abs(z[..., None] - z.take(things.which, axis=-1)[..., None, :])
    level = height[..., None] + height.take(things.which, axis=-1)[..., None, :] - off_level
    standing = np.maximum.reduce(np.where(things.is_drawer, on, -1.0), axis=-1, initial=-1.0)
    applies = np.minimum(level, standing.take(things.which, axis=-1)[..., None, :])
    applies = np.where(things.same, -1.0, applies)[..., None, :, :]
    blocking = np.minimum(sideways, applies)
    clear = strictly(-np.maximum.reduce(blocking, axis=-2, initial=-1.0))
    return BlockingRelations(
        things,
        on.reshape(*on.shape[:-2], -1),
        blocking.reshape(*blocking.shape[:-2], -1),
        clear,
    )


def _lying_on(things: DrawerObjectIndex, data: Array, blocks: Blocks) -> Array:
    """How well blocks touch surfaces, their middles over them: shape (..., blocks, surfaces)."""
    levels = data.take(things.levels, axis=-1)[..., None, :, :]
    middles = complex_of(data.take(things.middles, axis=-1))[..., 0]
    within = levels[..., 1:3] - along_axes(blocks.places[..., None] - middles[..., None, :])
    gap = (blocks.z - blocks.height)[..., None] - levels[..., 0] - levels[..., 3]
    touches = unpinched(TOUCHING - np.abs(gap))
    return np.minimum(touches, np.minimum(within[..., 0], within[..., 1]))


def _sideways(rooms: ClearanceBoxes, things: DrawerObjectIndex, blocks: Blocks) -> Array:
    """How far blocks are in the rooms for fingers, (..., sides, blocks, targets).

    One is in a room that no line separates it from: neither one along the target block's faces nor
    one along its own.
    """
    flat, places, which = blocks.flat, blocks.places, things.which
    back = turned_back(blocks.q, blocks.edges)
    named = _towards_base(back.take(which, axis=-1))
    own = widths(flat.take(which, axis=-2), named)
    middles = (own.take(AXES, axis=-1).swapaxes(-1, -2) + rooms.depth) * TOWARDS[:, None]
    way = (places[..., None] - places.take(which, axis=-1)[..., None, :]) * named[..., None, :]
    off = way[..., None, :, :] - middles[..., None, :]
    width = widths(flat[..., :, None, :], named[..., None, :])[..., None, :, :, :]
    gaps = along_axes(off) - width - rooms.halves
    turn = (back[..., None] * named[..., None, :].conj())[..., None, :, :]
    own_gaps = along_axes(off * turn) - along_axes(turn) @ rooms.spans
    own_gaps -= widths(flat, back)[..., None, :, None, :]
    apart = np.maximum(gaps, own_gaps)
    return -np.maximum(apart[..., 0], apart[..., 1])


def _towards_base(back: Complex) -> Complex:
    """The same up to quarter turns: the one that turns least."""
    steep = np.abs(back.imag) > np.abs(back.real)
    quarter = np.where(steep, back * 1j, back)
    return np.where(quarter.real < 0.0, -quarter, quarter)


@cache_latest
def over(state: State) -> tuple[DrawerObjectIndex, Array]:
    """How well the hand is over blocks, as margins in m, shape (..., blocks)."""
    things, data = DrawerObjectIndex.of(state.layout), state.data
    point = grasp_points(data.take(things.joints, axis=-1))
    aside = data.take(things.places, axis=-1) - point[..., None, :2]
    above = point[..., None, 2] - data.take(things.z, axis=-1)
    level = OVER_TOLERANCE - np.abs(above - OVER)
    return things, np.minimum(ASIDE_TOLERANCE - np.hypot(aside[..., 0], aside[..., 1]), level)


# -- predicates -----------------------------------------------------------------------------------


def _is_a(kind: Type) -> Classifier:
    def classifier(state: State, column: Column) -> Bools:
        truth = np.array([obj.type.is_a(kind) for obj in column.objects])
        return np.broadcast_to(truth, (*state.data.shape[:-1], len(truth)))

    return classifier


def _is_none(kind: Type) -> Classifier:
    is_a = _is_a(kind)
    return lambda state, column: ~is_a(state, column)


def _is(state: State, block: Column, label: str) -> Bools:
    return state.stack(block, label) > 0.5


def _gripper_empty(state: State, _: Column) -> Bools:
    held = _is(state, state.layout.column_of(BLOCK), "held")
    empty: Bools = ~np.logical_or.reduce(held, axis=-1, keepdims=True)
    return empty


def _ready_margin(state: State, _: Column, block: Column) -> Array:
    things, ready = over(state)
    return ready.take(things.numbers(block), axis=-1)


def _not_ready_margin(state: State, robot: Column, block: Column) -> Array:
    return strictly(-_ready_margin(state, robot, block))


def _hand_ready_margin(state: State, _: Column) -> Array:
    ready = over(state)[1]
    return strictly(-np.maximum.reduce(ready, axis=-1, initial=-1.0, keepdims=True))


def _on_margin(lie: Perceive) -> Margin:
    def margin(state: State, block: Column, surface: Column) -> Array:
        things, on, _, _ = lie(state)
        return on.take(things.numbers(block, surface), axis=-1)

    return margin


def _blocking_margin(lie: Perceive, side: int) -> Margin:
    def margin(state: State, block: Column, blocked: Column) -> Array:
        things, _, blocking, _ = lie(state)
        return blocking[..., side, :].take(things.numbers(block, blocked), axis=-1)

    return margin


def _clear_margin(lie: Perceive, side: int) -> Margin:
    def margin(state: State, block: Column) -> Array:
        things, _, _, clear = lie(state)
        return clear[..., side, :].take(things.target_numbers(block), axis=-1)

    return margin


Perceive = Callable[[State], BlockingRelations]


@lru_cache(maxsize=64)
def predicates(room: FingerClearance) -> tuple[Predicate, ...]:
    """All of them; blocks block where they leave less than this room."""
    lie = cache_latest(partial(blocking_relations, room))
    return (
        Predicate("IsRobot", (ROBOT,), _is_a(ROBOT)),
        Predicate("IsBlock", (THING,), _is_a(BLOCK)),
        Predicate("IsTable", (SURFACE,), _is_a(TABLE)),
        Predicate("IsDrawer", (SURFACE,), _is_a(DRAWER)),
        Predicate("IsMovable", (THING,), _is_a(BLOCK)),
        Predicate("NotIsMovable", (THING,), _is_none(BLOCK)),
        Predicate("IsTargetBlock", (BLOCK,), _is_a(TARGET)),
        Predicate("NotIsTargetBlock", (BLOCK,), _is_none(TARGET)),
        Predicate.threshold("ReadyPick", (ROBOT, BLOCK), _ready_margin),
        Predicate.threshold("NotReadyPick", (ROBOT, BLOCK), _not_ready_margin),
        Predicate.threshold("HandReadyPick", (ROBOT,), _hand_ready_margin),
        Predicate.threshold("On", (BLOCK, SURFACE), _on_margin(lie)),
        Predicate("Holding", (ROBOT, BLOCK), lambda state, _, b: _is(state, b, "held")),
        Predicate("NotHolding", (ROBOT, BLOCK), lambda state, _, b: ~_is(state, b, "held")),
        Predicate("GripperEmpty", (ROBOT,), _gripper_empty),
        *(
            Predicate.threshold(f"Blocking{name}", (BLOCK, TARGET), _blocking_margin(lie, side))
            for side, name in enumerate(SIDES)
        ),
        *(
            Predicate.threshold(f"{name}Clear", (TARGET,), _clear_margin(lie, side))
            for side, name in enumerate(SIDES)
        ),
    )


BY_NAME = {predicate.name: predicate for predicate in predicates(FingerClearance())}
ON = BY_NAME["On"]
HAND_PREDICATES = frozenset(
    BY_NAME[name] for name in ("ReadyPick", "NotReadyPick", "HandReadyPick")
)
GRASPING = frozenset(BY_NAME[name] for name in ("Holding", "NotHolding", "GripperEmpty"))


# -- operators ------------------------------------------------------------------------------------

Sketch = tuple[str, *tuple[Variable, ...]]  # a predicate's name, and variables

R, B, T = Variable("?r", ROBOT), Variable("?b", BLOCK), Variable("?t", TARGET)
S, D = Variable("?s", TABLE), Variable("?d", DRAWER)
B1, B2 = Variable("?b1", BLOCK), Variable("?b2", BLOCK)

EMPTY: Sketch = ("GripperEmpty", R)
FREE: Sketch = ("HandReadyPick", R)


def _operator(
    name: str,
    parameters: tuple[Variable, ...],
    needs: Sequence[Sketch],
    adds: Sequence[Sketch],
    deletes: Sequence[Sketch],
) -> LiftedOperator:
    """An operator whose parameters are also what the static predicates call them."""
    kinds: list[Sketch] = []
    for parameter in parameters:
        if parameter.type.is_a(BLOCK):
            label = "IsTargetBlock" if parameter == T else "NotIsTargetBlock"
            kinds += [("IsBlock", parameter), ("IsMovable", parameter), (label, parameter)]
        else:
            kinds.append((f"Is{parameter.type.name.capitalize()}", parameter))

    def atoms(sketches: Sequence[Sketch]) -> frozenset[LiftedAtom]:
        return frozenset(LiftedAtom(BY_NAME[n], tuple(objects)) for n, *objects in sketches)

    return LiftedOperator(name, parameters, atoms([*kinds, *needs]), atoms(adds), atoms(deletes))


def _reach() -> LiftedOperator:
    """Send the hand over any block."""
    reach = _operator(
        "Reach",
        (R, B),
        [EMPTY, FREE, ("NotReadyPick", R, B)],
        [("ReadyPick", R, B)],
        [FREE, ("NotReadyPick", R, B)],
    )
    either = LiftedAtom(BY_NAME["NotIsTargetBlock"], (B,))
    return replace(reach, preconditions=reach.preconditions - {either})


def _grasp(
    name: str,
    block: Variable,
    clear: Sequence[str] = (),
    blocked: Mapping[str, Variable] = MappingProxyType({}),
) -> LiftedOperator:
    """Take a block out from between those that block its other sides."""
    ready: Sketch = ("ReadyPick", R, block)
    on: Sketch = ("On", block, D)
    free: Sketch = ("NotHolding", R, block)
    blocking: list[Sketch] = [(f"Blocking{side}", b, block) for side, b in blocked.items()]
    return _operator(
        name,
        (R, block, *blocked.values(), D),
        [EMPTY, ready, on, free, *blocking, *((f"{side}Clear", block) for side in clear)],
        [
            ("Holding", R, block),
            ("NotReadyPick", R, block),
            FREE,
            *((f"{side}Clear", block) for side in blocked),
        ],
        [EMPTY, ready, on, free, *blocking],
    )


def _place_blocker(side: str) -> LiftedOperator:
    """Put a block that blocked a side elsewhere in the drawer."""
    holding: Sketch = ("Holding", R, B)
    blocking: Sketch = (f"Blocking{side}", B, T)
    return _operator(
        f"Place{side}Block",
        (R, B, T, D),
        [holding, blocking],
        [EMPTY, ("NotHolding", R, B), ("On", B, D), (f"{side}Clear", T)],
        [holding, blocking],
    )


def _place_target() -> LiftedOperator:
    """Put the target block on the table."""
    holding: Sketch = ("Holding", R, T)
    return _operator(
        "PlaceTarget",
        (R, T, S),
        [holding],
        [EMPTY, ("NotHolding", R, T), ("On", T, S)],
        [holding],
    )


OPERATORS = (
    _reach(),
    _grasp("GraspFrontBack", T, ("Front", "Back"), {"Left": B1, "Right": B2}),
    _grasp("GraspLeftRight", T, ("Left", "Right"), {"Front": B1, "Back": B2}),
    _grasp("GraspFullClear", T, SIDES),
    _grasp("GraspNonTarget", B),
    _place_target(),
    *(_place_blocker(side) for side in SIDES),
)
