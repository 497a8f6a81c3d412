# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What lies on what in one state, as compiled code: ``support_truths``, by the same arithmetic.

A box is a row of ten numbers, the arguments of ``ScalarBox`` in their order, where the comments are
that are missing here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.domains.obstacle_tower.support import CENTRED, TOUCHING
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
