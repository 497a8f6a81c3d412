# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random states of Obstacle Tower, and its relations of bodies, spelled out one by one."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.domains.obstacle_tower.support import CENTRED, TOUCHING
from slap_ros.geometry.pose import Pose, multiply, rotate
from slap_ros.relational import Object, State
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, TABLE_TOP

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def random_states(initial: State, rng: np.random.Generator, count: int) -> State:
    """A batch in which blocks lie, tumble, fly, stand on one another, on and beside the target."""
    layout = initial.layout
    data = np.repeat(initial.data[None], count, axis=0)
    target = initial[layout.object("target")][:2]
    for row in data:
        for block in layout.of_type(BLOCK):
            level, spread = rng.integers(3), rng.choice([0.003, 0.03, 0.3])
            part = layout.slices[block].start
            row[part : part + 2] = target + rng.uniform(-spread, spread, 2)
            row[part + 2] = TABLE_TOP + CUBE_EDGE * (level + 0.5) + rng.uniform(-0.006, 0.006)
            row[part + 3 : part + 7] = _turn(rng)
        if rng.random() < 0.3:
            held = layout.of_type(BLOCK)[rng.integers(len(layout.of_type(BLOCK)))]
            row[layout.column(held, "held")] = 1.0
    return State(layout, data)


def _turn(rng: np.random.Generator) -> tuple[float, ...]:
    """Tumbling, or on one of the faces, turned about the vertical."""
    if rng.random() < 0.2:
        turn = rng.normal(size=4)
        return tuple(turn / np.linalg.norm(turn))
    yaw, roll = rng.uniform(-math.pi, math.pi), rng.choice([0.0, 0.0, 0.5, 1.0, -0.5]) * math.pi
    return multiply(
        (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)),
        (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2)),
    )


def one_by_one(state: State) -> set[str]:
    """The fluent relations of bodies that hold in a single state."""
    blocks, surfaces = state.layout.of_type(BLOCK), state.layout.of_type(SURFACE)
    found = {f"On({b}, {t})" for b in blocks for t in (*blocks, *surfaces) if _on(state, b, t)}
    for thing in (*blocks, *surfaces):
        for_one = _get(state, thing, "is_movable") or _get(state, thing, "is_target")
        others = [block for block in blocks if block != thing]
        if not (for_one and any(_over(state, block, thing) for block in others)):
            found.add(f"NothingOn({thing})")
    return found


def _on(state: State, block: Object, thing: Object) -> bool:
    if block == thing or not _touches(state, block, thing):
        return False
    if _get(state, thing, "is_target"):
        return _centred(state, block, thing)
    targets = [s for s in state.layout.of_type(SURFACE) if _get(state, s, "is_target")]
    if not _get(state, thing, "is_movable") and any(_centred(state, block, t) for t in targets):
        return False
    return _over(state, block, thing)


def _over(state: State, block: Object, thing: Object) -> bool:
    if not _touches(state, block, thing):
        return False
    x, y, z, w = _pose(state, thing).quaternion
    sine, cosine = max((z, w), (y, x), key=lambda parts: math.hypot(*parts))
    yaw = 2.0 * math.atan2(sine, cosine)
    return all(
        abs(_along(axis, _offset(state, block, thing)))
        <= _reach(state, block, axis) + _reach(state, thing, axis)
        for axis in ((math.cos(yaw), math.sin(yaw), 0.0), (-math.sin(yaw), math.cos(yaw), 0.0))
    )


def _touches(state: State, block: Object, thing: Object) -> bool:
    gap = _offset(state, block, thing)[2]
    gap -= _reach(state, block, AXES[2]) + _reach(state, thing, AXES[2])
    return abs(gap) <= TOUCHING


def _centred(state: State, block: Object, target: Object) -> bool:
    return math.hypot(*_offset(state, block, target)[:2]) <= CENTRED


def _offset(state: State, block: Object, thing: Object) -> tuple[float, float, float]:
    a, b = _pose(state, block).position, _pose(state, thing).position
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _reach(state: State, thing: Object, axis: tuple[float, float, float]) -> float:
    """How far a box reaches from its centre along an axis, m."""
    turn = _pose(state, thing).quaternion
    half = (_get(state, thing, f"half_{name}") for name in "xyz")
    return sum(abs(_along(axis, rotate(turn, a))) * h for a, h in zip(AXES, half, strict=True))


def _along(axis: tuple[float, float, float], vector: tuple[float, float, float]) -> float:
    return sum(a * b for a, b in zip(axis, vector, strict=True))


def _pose(state: State, obj: Object) -> Pose:
    x, y, z, *turn = state[obj][:7].tolist()
    return Pose((x, y, z), tuple(turn))


def _get(state: State, obj: Object, feature: str) -> float:
    return float(state.get(obj, feature))
