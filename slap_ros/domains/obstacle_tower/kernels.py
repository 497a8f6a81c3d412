# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What lies on what, as compiled code: ``support`` and ``margins`` by the same arithmetic.

A box is a row of ten numbers, the arguments of ``ScalarBox`` in their order. There, and in
``footprints``, are the comments that are missing here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.domains.classifiers import TINY
from slap_ros.domains.obstacle_tower.support import CENTRED, TOUCHING
from slap_ros.domains.tabletop.footprints import STEEPNESS, TO_EDGES
from slap_ros.relational.state import Array

Flags = NDArray[np.bool_]
Vector2 = tuple[float, float]


@compiled
def support(boxes: Array, blocks: int, is_movable: Flags, is_target: Flags) -> tuple[Flags, Flags]:
    """Which block is on which thing, and which thing has room for a block.

    Args:
        boxes: Blocks, then surfaces, shape (things, 10).
        blocks: Number of blocks.
        is_movable: Whether each thing is, shape (things,).
        is_target: Whether each thing is, shape (things,).

    Returns:
        Shapes (blocks, things) and (things,).
    """
    things = len(boxes)
    on, room = np.zeros((blocks, things), np.bool_), np.ones(things, np.bool_)
    for block in range(blocks):
        bottom = boxes[block, 2] - _height(boxes[block])
        for thing in range(things):
            top = boxes[thing, 2] + _height(boxes[thing])
            if abs(bottom - top) > TOUCHING:
                continue
            covers = _covers(boxes[block], boxes[thing])
            if is_target[thing]:
                on[block, thing] = _is_centred(boxes[block], boxes[thing])
            else:
                off_targets = is_movable[thing] or not _is_on_any(block, boxes, blocks, is_target)
                on[block, thing] = covers and off_targets
            if covers and (is_movable[thing] or is_target[thing]):
                room[thing] = False
    return on, room


@inner
def _is_on_any(block: int, boxes: Array, blocks: int, is_target: Flags) -> bool:
    for thing in range(blocks, len(boxes)):
        if is_target[thing] and _is_centred(boxes[block], boxes[thing]):
            return True
    return False


@inner
def _is_centred(block: Array, target: Array) -> bool:
    return bool(math.hypot(block[0] - target[0], block[1] - target[1]) <= CENTRED)


@inner
def _up(box: Array) -> float:
    w, z, x, y = box[3], box[4], box[5], box[6]
    up: float = w * w + z * z - x * x - y * y
    return up


@inner
def _height(box: Array) -> float:
    w, z, x, y = box[3], box[4], box[5], box[6]
    height: float = abs(2.0 * (x * z - w * y) * box[7]) + abs(2.0 * (y * z + w * x) * box[8])
    height += abs(_up(box) * box[9])
    return height


@inner
def _covers(box: Array, other: Array) -> bool:
    x, y = box[0] - other[0], box[1] - other[1]
    distance2, least = x * x + y * y, min(other[7], other[8], other[9])
    if distance2 <= least * least:
        return True
    most = box[7] + box[8] + box[9]
    reach = most + (other[7] + other[8] + other[9])
    if distance2 > reach * reach:
        return False
    a, b = (other[3], other[4]) if _up(other) > 0.0 else (other[5], other[6])
    scale = 1.0 / (a * a + b * b)
    cos, sin = (a * a - b * b) * scale, 2.0 * a * b * scale
    ahead, aside = _reach(other, cos, sin)
    ahead -= abs(cos * x + sin * y)
    aside -= abs(cos * y - sin * x)
    if ahead >= 0.0 and aside >= 0.0:
        return True
    more_ahead, more_aside = _reach(box, cos, sin)
    return bool(ahead + more_ahead >= 0.0 and aside + more_aside >= 0.0)


@inner
def _reach(box: Array, cos: float, sin: float) -> Vector2:
    w, z, x, y = box[3], box[4], box[5], box[6]
    a, b, c = box[7], box[8], box[9]
    ax, ay = (w * w + x * x - y * y - z * z) * a, 2.0 * (x * y + w * z) * a
    bx, by = 2.0 * (x * y - w * z) * b, (w * w + y * y - x * x - z * z) * b
    cx, cy = 2.0 * (x * z + w * y) * c, 2.0 * (y * z - w * x) * c
    return (
        abs(cos * ax + sin * ay) + abs(cos * bx + sin * by) + abs(cos * cx + sin * cy),
        abs(cos * ay - sin * ax) + abs(cos * by - sin * bx) + abs(cos * cy - sin * cx),
    )


@compiled
def margins(boxes: Array, blocks: int, is_movable: Flags, is_target: Flags) -> tuple[Array, Array]:
    """The margins of the same relations; see ``margins`` in ``support.py``.

    Args:
        boxes: Blocks, then surfaces, of n states, shape (n, things, 10).
        blocks: Number of blocks.
        is_movable: Whether each thing is, shape (n, things).
        is_target: Whether each thing is, shape (n, things).

    Returns:
        In m, shapes (n, blocks, things) and (n, things).
    """
    states, things = is_target.shape
    on, room = np.empty((states, blocks, things)), np.ones((states, things))
    edges, back, own = np.empty((things, 9)), np.empty((things, 2)), np.empty((things, 2))
    for state in range(states):
        for i in range(things):
            _place_edges(boxes[state, i], edges[i])
            _place_inverse_yaw(boxes[state, i], edges[i, 8] > 0.0, back[i])
            own[i, 0], own[i, 1] = _half_widths(edges[i], back[i])
        for i in range(things):
            over, top = -1.0, boxes[state, i, 2] + _reach_up(edges[i])
            for block in range(blocks):
                gap = boxes[state, block, 2] - _reach_up(edges[block]) - top
                touches = _steepened(TOUCHING - abs(gap))
                dx = boxes[state, block, 0] - boxes[state, i, 0]
                dy = boxes[state, block, 1] - boxes[state, i, 1]
                ahead, aside = _half_widths(edges[block], back[i])
                x, y = _turned(dx, dy, back[i])
                covers = min(ahead + own[i, 0] - abs(x), aside + own[i, 1] - abs(y))
                over = max(over, min(touches, covers))
                sideways = covers
                if is_target[state, i]:
                    sideways = CENTRED - math.hypot(dx, dy)
                elif not is_movable[state, i]:
                    off_targets = _off_targets(boxes[state], block, blocks, is_target[state])
                    sideways = min(covers, off_targets)
                on[state, block, i] = min(touches, sideways)
            if is_movable[state, i] or is_target[state, i]:
                room[state, i] = -over - TINY
    return on, room


@inner
def _off_targets(boxes: Array, block: int, blocks: int, is_target: Flags) -> float:
    """How far a block is from being in a target, m; it is not at 0."""
    nearest = -1.0
    for i in range(blocks, len(boxes)):
        if is_target[i]:
            x, y = boxes[block, 0] - boxes[i, 0], boxes[block, 1] - boxes[i, 1]
            nearest = max(nearest, CENTRED - math.hypot(x, y))
    return -nearest - TINY


@inner
def _steepened(tolerance: float) -> float:
    return max(tolerance, STEEPNESS * tolerance)


@inner
def _place_edges(box: Array, edges: Array) -> None:
    for m in range(9):
        edges[m] = 0.0
    for i in range(4):
        for j in range(4):
            product = box[3 + i] * box[3 + j]
            for m in range(9):
                edges[m] += product * TO_EDGES[4 * i + j, m]
    for m in range(9):
        edges[m] *= box[7 + (m // 2 if m < 6 else m - 6)]


@inner
def _reach_up(edges: Array) -> float:
    height: float = abs(edges[6]) + abs(edges[7]) + abs(edges[8])
    return height


@inner
def _place_inverse_yaw(box: Array, upright: bool, back: Array) -> None:
    """Write a complex number over its conjugate, inverted, as numpy divides."""
    a, b = (box[3], box[4]) if upright else (box[5], box[6])
    if abs(a) >= abs(b):
        ratio = b / a
        scale = 1.0 / (a + b * ratio)
        back[0], back[1] = (a + -b * ratio) * scale, (-b - a * ratio) * scale
    else:
        ratio = a / b
        scale = 1.0 / (b + a * ratio)
        back[0], back[1] = (a * ratio + -b) * scale, (-b * ratio - a) * scale


@inner
def _turned(x: float, y: float, back: Array) -> Vector2:
    return x * back[0] - y * back[1], x * back[1] + y * back[0]


@inner
def _half_widths(edges: Array, back: Array) -> Vector2:
    ahead, aside = 0.0, 0.0
    for edge in range(3):
        x, y = _turned(edges[2 * edge], edges[2 * edge + 1], back)
        ahead += abs(x)
        aside += abs(y)
    return ahead, aside
