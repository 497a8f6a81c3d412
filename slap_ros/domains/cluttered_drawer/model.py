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
  it may be sent to any. Grasping ends either.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from slap_ros.domains.tabletop.lying import (
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
from slap_ros.domains.tabletop.reading import HALF_NAMES, JOINT_NAMES
from slap_ros.domains.tabletop.seeing import grasp_point
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
from slap_ros.relational.predicates import Bools, Classifier, Margin, shared
from slap_ros.relational.state import Array

TOUCHING = 0.004  # height over a surface at which a block still lies on it
OVER = 0.05  # height of the grasp point over the middle of a block that it is ready to pick
OVER_TOLERANCE = 0.02  # up and down
ASIDE_TOLERANCE = 0.015  # sideways
MOST_REMEMBERED = 1024  # columns of objects, a layout

SIZE_FEATURES = tuple(Feature(name, "m") for name in HALF_NAMES)  # half its edges
THING = Type("thing")
BLOCK = Type(
    "block", (*BODY_FEATURES, *MATERIAL_FEATURES, *SIZE_FEATURES, Feature("is_target", "1")), THING
)
SURFACE = Type("surface", (*POSE_FEATURES, *SIZE_FEATURES), THING)
TABLE = Type("table", SURFACE.features, SURFACE)
DRAWER = Type("drawer", SURFACE.features, SURFACE)  # its floor
WALL = Type("wall", (*POSE_FEATURES, *SIZE_FEATURES))  # of the drawer; no predicate asks for it
TYPES = (ROBOT, THING, BLOCK, SURFACE, TABLE, DRAWER, WALL)

SIDES = ("Front", "Back", "Left", "Right")
TOWARDS = np.array([-1.0, 1.0, 1.0j, -1.0j])  # each side, seen from a block that is not turned


@dataclass(frozen=True)
class FingerRoom:
    """What has to be free at a side of the target block, so that a finger fits there.

    Args:
        reach: How far from its face. A finger that is open ends 4.2 cm from it.
        half_width: To each side of the middle. A finger is 2.1 cm wide.
    """

    reach: float = 0.048
    half_width: float = 0.016


@dataclass(frozen=True, eq=False)
class Things:
    """The blocks and surfaces of a layout, and where their features are."""

    blocks: tuple[Object, ...]
    surfaces: tuple[Object, ...]
    quaternions: Indices  # (blocks, 4), parts as in PARTS
    places: Indices  # (blocks, 2): x, y
    halves: Indices  # (blocks, 9), as in TO_EDGES
    z: Indices  # (blocks,)
    is_target: Indices  # (blocks,)
    bounds: Indices  # (surfaces, 6): pose's x, y, z, half its edges
    is_drawer: Bools  # (surfaces,)
    joints: Indices  # (7,)
    _numbers: dict[Column, Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> Things:
        """Those of a layout."""
        blocks, surfaces = layout.of_type(BLOCK), layout.of_type(SURFACE)

        def where(objects: Sequence[Object], *features: str) -> Indices:
            return np.array([layout.columns(objects, name) for name in features]).T

        return Things(
            blocks,
            surfaces,
            where(blocks, *PARTS),
            where(blocks, "x", "y"),
            where(blocks, *HALVES),
            layout.columns(blocks, "z"),
            layout.columns(blocks, "is_target"),
            where(surfaces, "x", "y", "z", *HALF_NAMES),
            np.array([surface.type.is_a(DRAWER) for surface in surfaces]),
            where(layout.of_type(ROBOT), *JOINT_NAMES).reshape(-1),
        )

    def numbers(self, column: Column) -> Indices:
        """The blocks or surfaces of a column as numbers."""
        numbers = self._numbers.get(column)
        if numbers is None:
            among = self.blocks if column.objects[0].type.is_a(BLOCK) else self.surfaces
            numbers = np.array([among.index(obj) for obj in column.objects])
            if len(self._numbers) == MOST_REMEMBERED:
                self._numbers.clear()
            self._numbers[column] = numbers
        return numbers


# -- margins --------------------------------------------------------------------------------------


class Lie(NamedTuple):
    """How everything lies in a state, as margins in m."""

    things: Things
    on: Array  # of blocks on surfaces, shape (..., blocks * surfaces)
    blocking: Array  # of blocks at sides of blocks, shape (..., sides, blocks * blocks)
    clear: Array  # of sides of blocks, shape (..., sides, blocks)


def lie_with(room: FingerRoom, state: State) -> Lie:
    """How everything lies, all at once, with so much room for a finger.

    Horizontal vectors are complex numbers: turned by a product, seen along both axes at once.
    """
    things, data = Things.of(state.layout), state.data
    q = data.take(things.quaternions, axis=-1)
    products = (q[..., None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    edges = products @ TO_EDGES * data.take(things.halves, axis=-1)
    places = complex_of(data.take(things.places, axis=-1))[..., 0]
    z, height = data.take(things.z, axis=-1), np.add.reduce(np.abs(edges[..., 6:]), axis=-1)

    # On a surface it touches what its lowest point is at the height of, its middle over it.
    bounds = data.take(things.bounds, axis=-1)
    gap = (z - height)[..., None] - (bounds[..., 2] + bounds[..., 5])[..., None, :]
    middles = complex_of(np.ascontiguousarray(bounds[..., :2]))[..., 0]
    inside = bounds[..., None, :, 3:5] - along_axes(places[..., None] - middles[..., None, :])
    within = np.minimum(inside[..., 0], inside[..., 1])
    on = np.minimum(unpinched(TOUCHING - np.abs(gap)), within)
    in_drawer = np.maximum.reduce(np.where(things.is_drawer, on, -1.0), axis=-1)

    # It blocks a side where no line separates it from the room for a finger there: neither one
    # along the target block's faces nor one along its own.
    flat, back = complex_of(edges[..., :6]), turned_back(q, edges)
    named = _towards_base(back)
    own_width = widths(flat, named)
    rooms = _rooms(own_width, room)
    way = (places[..., :, None] - places[..., None, :]) * named[..., None, :]
    off = way[..., None, :, :] - rooms.middles[..., None, :]
    width = widths(flat[..., :, None, :], named[..., None, :])
    overlap = width[..., None, :, :, :] + rooms.halves[:, None, None, :] - along_axes(off)
    turn = back[..., :, None] * named[..., None, :].conj()
    turned_rooms = _turned(rooms.halves, turn)
    own_overlap = (
        widths(flat, back)[..., None, :, None, :]
        + turned_rooms
        - along_axes(off * turn[..., None, :, :])
    )
    sideways = np.minimum.reduce(np.minimum(overlap, own_overlap), axis=-1)
    level = height[..., :, None] + height[..., None, :]
    level = level - np.abs(z[..., :, None] - z[..., None, :])
    applies = np.minimum(level, in_drawer[..., None, :])[..., None, :, :]
    is_target = data.take(things.is_target, axis=-1)[..., None, None, :] > 0.5
    others = ~np.eye(len(things.blocks), dtype=bool)
    blocking = np.where(is_target & others, np.minimum(sideways, applies), -1.0)
    worst = np.maximum.reduce(blocking, axis=-2, initial=-1.0)
    clear = np.where(is_target[..., 0, :], strictly(-worst), -1.0)
    shape = blocking.shape
    return Lie(
        things,
        on.reshape(*on.shape[:-2], -1),
        blocking.reshape(*shape[:-2], -1),
        clear,
    )


class _Rooms(NamedTuple):
    """The rooms for fingers beside blocks, seen along the axes of these."""

    middles: Complex  # from the block's, shape (..., sides, blocks)
    halves: Array  # half their edges, shape (sides, 2)


def _rooms(own_width: Array, room: FingerRoom) -> _Rooms:
    ahead, aside = own_width[..., None, :, 0], own_width[..., None, :, 1]
    face = np.where(TOWARDS.real[:, None] != 0.0, ahead, aside)
    depth = room.reach / 2
    halves = np.where(
        TOWARDS.real[:, None] != 0.0, [depth, room.half_width], [room.half_width, depth]
    )
    return _Rooms((face + depth) * TOWARDS[:, None], halves)


def _turned(halves: Array, turn: Complex) -> Array:
    """How far rooms reach along axes turned against theirs, (..., sides, blocks, blocks, 2)."""
    cos, sin = np.abs(turn.real), np.abs(turn.imag)
    ahead, aside = halves[:, 0, None, None], halves[:, 1, None, None]
    cos, sin = cos[..., None, :, :], sin[..., None, :, :]
    return np.stack([cos * ahead + sin * aside, cos * aside + sin * ahead], axis=-1)


def _towards_base(back: Complex) -> Complex:
    """The same up to quarter turns: the one that turns least."""
    steep = np.abs(back.imag) > np.abs(back.real)
    quarter = np.where(steep, back * 1j, back)
    return np.where(quarter.real < 0.0, -quarter, quarter)


@shared
def over(state: State) -> tuple[Things, Array]:
    """How well the hand is over blocks, as margins in m, shape (..., blocks)."""
    things, data = Things.of(state.layout), state.data
    point = grasp_point(data.take(things.joints, axis=-1))
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
        number = things.numbers(block) * len(things.surfaces) + things.numbers(surface)
        return on.take(number, axis=-1)

    return margin


def _blocking_margin(lie: Perceive, side: int) -> Margin:
    def margin(state: State, block: Column, blocked: Column) -> Array:
        things, _, blocking, _ = lie(state)
        number = things.numbers(block) * len(things.blocks) + things.numbers(blocked)
        return blocking[..., side, :].take(number, axis=-1)

    return margin


def _clear_margin(lie: Perceive, side: int) -> Margin:
    def margin(state: State, block: Column) -> Array:
        things, _, _, clear = lie(state)
        return clear[..., side, :].take(things.numbers(block), axis=-1)

    return margin


Perceive = Callable[[State], Lie]


@lru_cache(maxsize=64)
def predicates(room: FingerRoom) -> tuple[Predicate, ...]:
    """All of them; blocks block where they leave less than this room."""
    lie = shared(partial(lie_with, room))
    return (
        Predicate("IsRobot", (ROBOT,), _is_a(ROBOT)),
        Predicate("IsBlock", (THING,), _is_a(BLOCK)),
        Predicate("IsTable", (SURFACE,), _is_a(TABLE)),
        Predicate("IsDrawer", (SURFACE,), _is_a(DRAWER)),
        Predicate("IsMovable", (THING,), _is_a(BLOCK)),
        Predicate("NotIsMovable", (THING,), _is_none(BLOCK)),
        Predicate("IsTargetBlock", (BLOCK,), lambda state, b: _is(state, b, "is_target")),
        Predicate("NotIsTargetBlock", (BLOCK,), lambda state, b: ~_is(state, b, "is_target")),
        Predicate.threshold("ReadyPick", (ROBOT, BLOCK), _ready_margin),
        Predicate.threshold("NotReadyPick", (ROBOT, BLOCK), _not_ready_margin),
        Predicate.threshold("HandReadyPick", (ROBOT,), _hand_ready_margin),
        Predicate.threshold("On", (BLOCK, SURFACE), _on_margin(lie)),
        Predicate("Holding", (ROBOT, BLOCK), lambda state, _, b: _is(state, b, "held")),
        Predicate("NotHolding", (ROBOT, BLOCK), lambda state, _, b: ~_is(state, b, "held")),
        Predicate("GripperEmpty", (ROBOT,), _gripper_empty),
        *(
            Predicate.threshold(f"Blocking{name}", (BLOCK, BLOCK), _blocking_margin(lie, side))
            for side, name in enumerate(SIDES)
        ),
        *(
            Predicate.threshold(f"{name}Clear", (BLOCK,), _clear_margin(lie, side))
            for side, name in enumerate(SIDES)
        ),
    )


BY_NAME = {predicate.name: predicate for predicate in predicates(FingerRoom())}
ON = BY_NAME["On"]
GRASPING = frozenset(BY_NAME[name] for name in ("Holding", "NotHolding", "GripperEmpty"))


# -- operators ------------------------------------------------------------------------------------

Sketch = tuple[str, *tuple[Variable, ...]]  # a predicate's name, and variables

R, B, T = Variable("?r", ROBOT), Variable("?b", BLOCK), Variable("?t", BLOCK)
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
        if parameter.type == BLOCK:
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
