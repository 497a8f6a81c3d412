# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: what is on what, above what, and where the hand is. Lengths in m, base frame.

Seen one pair at a time, with a block's box [bottom, top] along z and ``place`` its position:

- a block is *on the table* if ``|bottom - table top| <= LOW`` and ``place``, turned back by the
  table's yaw, is within the table's half edges;
- it is *on the bin* if ``place`` is within the bin's half edges less its walls, and within its
  height, it is not held, and it moves no faster than SLOW;
- it is *above everything* if ``bottom >= top of all other blocks and of the table + CLEAR``;
- the hand is *ready to pick* it if it holds nothing, is at most ASIDE beside ``place`` and OVER
  (+- BAND) above it;
- the hand is *above everything* if it holds nothing and its fingers' ends are HAND_CLEAR higher
  than all that is not held and than the table.

The code below computes all of these at once, of many states, as margins.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slap_ros.domains.cleanup_table.features import WALL, CleanupObjectIndex
from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.footprints import (
    OrderedSums,
    along_axes,
    complex_of,
    products_of_parts,
    turned,
)
from slap_ros.domains.tabletop.state_access import JOINT_NAMES
from slap_ros.relational import State
from slap_ros.relational.predicates import Bools, cache_latest
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT

LOW = 0.03  # height over the table at which a thing still counts as on it
OVER, ASIDE = 0.05, 0.02  # of a hand ready to pick: over the thing's middle, and off it at most
BAND = 0.02  # of OVER, either way
TIP = 0.009  # from between the fingertips to their ends
CLEAR, HAND_CLEAR = 0.03, 0.045  # over everything else: of a block, of the fingers' ends
SLOW = 0.2  # m/s, of what has landed in the bin
SPEED_SCALE_S = 0.1  # s, which makes a speed a margin
BUSY = 0.05  # margin that is missing at least while a hand is full that should be empty


class CleanupRelations(NamedTuple):
    """The relations of a state, as margins in m."""

    on: Array  # of blocks on surfaces, shape (..., blocks, surfaces)
    above: Array  # of blocks over everything else, shape (..., blocks)
    ready: Array  # of the hand over blocks, shape (..., blocks)
    hand_ready: Array  # shape (...)
    highest: Array  # height of the highest point of what is not in the hand, shape (...)


@cache_latest
def cleanup_relations(state: State) -> CleanupRelations:
    """The relations of one state or a batch: all at once, as predicates share most of the work."""
    index = CleanupObjectIndex.of(state.layout)
    blocks = state.data.take(index.block_columns, axis=-1)
    surfaces = state.data.take(index.surface_columns, axis=-1)
    bottom, top = _extents(blocks)
    held = blocks[..., 10] > 0.5
    full = np.logical_or.reduce(held, axis=-1)
    # The bin is lower than the table.
    table_top = np.maximum.reduce(surfaces[..., 4] + surfaces[..., 7], axis=-1)

    # What is in the hand is in nobody's way, and need only be higher than what is not.
    tops = np.where(held, -np.inf, top)
    others = np.where(index.others, tops[..., None, :], -np.inf)
    highest_other = np.maximum(np.maximum.reduce(others, axis=-1), table_top[..., None])
    highest = np.maximum(np.maximum.reduce(tops, axis=-1), table_top)

    joints = state.gather(state.layout.column_of(ROBOT), JOINT_NAMES)[..., 0, :]
    hand = observation.grasp_points(joints)
    offset = hand[..., None, :] - blocks[..., :3]
    aside = ASIDE - np.hypot(offset[..., 0], offset[..., 1])
    ready = _all_of(np.stack([aside, BAND - np.abs(offset[..., 2] - OVER)]))
    return CleanupRelations(
        _on(blocks, surfaces, bottom, held),
        bottom - highest_other - CLEAR,
        _idle(ready, full[..., None]),
        _idle(hand[..., 2] - TIP - highest - HAND_CLEAR, full),
        highest,
    )


X, Y, Z, W = range(4)


def _to_up() -> Array:
    """The linear map from the products of a quaternion's parts to how far its axes point up."""
    to = np.zeros((4, 4, 3))
    to[X, Z, 0], to[Y, W, 0] = 2.0, -2.0
    to[Y, Z, 1], to[X, W, 1] = 2.0, 2.0
    to[Z, Z, 2], to[W, W, 2], to[X, X, 2], to[Y, Y, 2] = 1.0, 1.0, -1.0, -1.0
    return to.reshape(16, 3)


UP = OrderedSums.of(_to_up())


def _extents(blocks: Array) -> tuple[Array, Array]:
    """Heights of the lowest and highest points of the boxes around blocks, shape (..., blocks)."""
    q = blocks[..., 3:7]
    up = UP(products_of_parts(q))
    middle = blocks[..., 2] + np.add.reduce(up * blocks[..., 14:17], axis=-1)
    half_height = np.add.reduce(np.abs(up) * blocks[..., 11:14], axis=-1)
    return middle - half_height, middle + half_height


def _on(blocks: Array, surfaces: Array, bottom: Array, held: Bools) -> Array:
    """Blocks are on the table as long as they are low; in the bin when they have landed in it."""
    is_drawer = (surfaces[..., 8] > 0.5)[..., None, :]
    z, half_z = surfaces[..., None, :, 4], surfaces[..., None, :, 7]
    walls = np.where(is_drawer, WALL, 0.0)[..., None]

    # Sideways, vectors are complex numbers: turned by a product.
    pairs = complex_of(np.ascontiguousarray(surfaces[..., None, :, :4]))
    place = complex_of(np.ascontiguousarray(blocks[..., :2]))
    half_turn = pairs[..., 1].conj()  # back, by the yaw
    offset = turned(place - pairs[..., 0], turned(half_turn, half_turn))
    sideways = surfaces[..., None, :, 5:7] - walls - along_axes(offset)

    gap = bottom[..., :, None] - z - half_z
    inside = half_z - np.abs(blocks[..., 2, None] - z)
    speed = np.sqrt(np.add.reduce(np.square(blocks[..., 7:10]), axis=-1))
    slow = SPEED_SCALE_S * (SLOW - speed)[..., None]
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
