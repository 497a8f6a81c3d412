# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: what lies on what, which block is in a finger's way, where the hand is.

Lengths in m, base frame. Sides are those of the target block, named as the robot in front of the
drawer sees them: its front is the face that looks most towards the robot (-x), its left the one
that looks most to +y. For one block b, surface s and target block t, in plain terms:

- b is *on* s if ``|bottom of b - top of s| <= TOUCHING`` and the middle of b is over s.
- A finger needs, at each side of t, a rectangle that is free: as deep as ``clearance.reach`` from
  the face, and ``clearance.half_width`` to each side of the face's middle.
- b *blocks* that side of t if b is not t, t stands in the drawer, b and t share a height
  (``|z of b - z of t| <= half height of b + half height of t``), and b, seen from above, overlaps
  the rectangle. Two rectangles are apart if, along an axis of one of them,
  ``|distance of the middles| > half the span of one + half the span of the other``.
- The side is *clear* if no block blocks it.
- The hand is *ready to pick* b if the grasp point is OVER (+- OVER_TOLERANCE) above the middle of b
  and at most ASIDE_TOLERANCE beside it.

The code below computes the margins of all of these at once, of one state or of many.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slap_ros.domains.classifiers import strictly
from slap_ros.domains.cluttered_drawer.features import DrawerObjectIndex
from slap_ros.domains.tabletop.footprints import (
    Complex,
    along_axes,
    complex_of,
    half_widths,
    inverse_yaws,
    steepened,
    turned,
    unit_edges,
)
from slap_ros.domains.tabletop.observation import grasp_points
from slap_ros.relational import State
from slap_ros.relational.predicates import cache_latest
from slap_ros.relational.state import Array

TOUCHING = 0.004  # height over a surface at which a block still lies on it
OVER = 0.05  # height of the grasp point over the middle of a block that it is ready to pick
OVER_TOLERANCE = 0.02  # up and down
ASIDE_TOLERANCE = 0.015  # sideways

SIDES = ("Front", "Back", "Left", "Right")
TOWARDS = np.array([-1.0, 1.0, 1.0j, -1.0j])  # each side, seen from a block that is not turned
AXES = np.array([0, 0, 1, 1])  # along which they lie


@dataclass(frozen=True)
class FingerClearance:
    """What has to be free at a side of the target block, so that a finger fits there.

    Args:
        reach: Free distance from the block's face, m. A finger that is open ends 4.2 cm from it.
        half_width: Free distance to each side of the face's middle, m. A finger is 2.1 cm wide.
    """

    reach: float = 0.048
    half_width: float = 0.016


class BlockingRelations(NamedTuple):
    """The relations of blocks in a state, as margins in m."""

    objects: DrawerObjectIndex
    on: Array  # of blocks on surfaces, shape (..., blocks * surfaces)
    blocking: Array  # of blocks at sides of target blocks, shape (..., sides, blocks * targets)
    clear: Array  # of these sides, shape (..., sides, targets)


def blocking_relations(clearance: FingerClearance, state: State) -> BlockingRelations:
    """All relations of blocks at once, where a finger needs this clearance."""
    index, data = DrawerObjectIndex.of(state.layout), state.data
    blocks = _blocks(index, data)
    on = _on(index, data, blocks)
    overlap = _overlap(ClearanceBoxes.of(clearance), index, blocks)
    blocking = np.minimum(overlap, _same_level(index, blocks, on)[..., None, :, :])
    clear = strictly(-np.maximum.reduce(blocking, axis=-2, initial=-1.0))
    return BlockingRelations(
        index,
        on.reshape(*on.shape[:-2], -1),
        blocking.reshape(*blocking.shape[:-2], -1),
        clear,
    )


class ClearanceBoxes(NamedTuple):
    """The clearances at all sides as boxes along the faces of the block that they are at."""

    depth: float  # half the reach
    halves: Array  # half their edges, shape (sides, 1, 1, 2)
    spans: Array  # from |cos| and |sin| of a turn to half their spans then, (sides, 1, 2, 2)

    @staticmethod
    @lru_cache(maxsize=64)
    def of(clearance: FingerClearance) -> ClearanceBoxes:
        """The boxes for a clearance."""
        depth = clearance.reach / 2
        ahead, aside = (depth, clearance.half_width), (clearance.half_width, depth)
        halves = np.array([aside if side.imag else ahead for side in TOWARDS])
        spans = np.stack([halves, halves[:, ::-1]], axis=-1)
        return ClearanceBoxes(depth, halves[:, None, None], spans[:, None])

    def spans_after(self, turn: Complex) -> Array:
        """Half their spans after turns, shape (..., sides, blocks, targets, 2)."""
        # Added up by hand: a product of matrices has other last bits on another processor.
        cos, sin = np.split(along_axes(turn), 2, axis=-1)
        spans: Array = cos * self.spans[..., :1, :] + sin * self.spans[..., 1:, :]
        return spans


class Blocks(NamedTuple):
    """The blocks of a state. Horizontal vectors are complex numbers: turned by a product."""

    q: Array  # parts of their quaternions, shape (..., blocks, 4)
    edges: Array  # shape (..., blocks, 9), as in TO_EDGES
    flat: Complex  # their edges seen from above, shape (..., blocks, 3)
    places: Complex  # shape (..., blocks), as those that follow
    z: Array
    height: Array  # half of it


def _blocks(index: DrawerObjectIndex, data: Array) -> Blocks:
    q = data.take(index.quaternions, axis=-1)
    edges = unit_edges(q) * data.take(index.halves, axis=-1)
    height = np.add.reduce(np.abs(edges[..., 6:]), axis=-1)
    places = complex_of(data.take(index.places, axis=-1))[..., 0]
    z = data.take(index.z, axis=-1)
    return Blocks(q, edges, complex_of(edges[..., :6]), places, z, height)


def _on(index: DrawerObjectIndex, data: Array, blocks: Blocks) -> Array:
    """How well blocks touch surfaces, their middles over them: shape (..., blocks, surfaces)."""
    levels = data.take(index.levels, axis=-1)[..., None, :, :]
    middles = complex_of(data.take(index.middles, axis=-1))[..., 0]
    within = levels[..., 1:3] - along_axes(blocks.places[..., None] - middles[..., None, :])
    gap = (blocks.z - blocks.height)[..., None] - levels[..., 0] - levels[..., 3]
    touches = steepened(TOUCHING - np.abs(gap))
    return np.minimum(touches, np.minimum(within[..., 0], within[..., 1]))


def _same_level(index: DrawerObjectIndex, blocks: Blocks, on: Array) -> Array:
    """How far blocks share the height of a target that stands in the drawer.

    Returns:
        Shape (..., blocks, targets); -1 for the target block itself.
    """
    rows, z, height = index.target_rows, blocks.z, blocks.height
    off_level = np.abs(z[..., None] - z.take(rows, axis=-1)[..., None, :])
    level = height[..., None] + height.take(rows, axis=-1)[..., None, :] - off_level
    in_drawer = np.maximum.reduce(np.where(index.is_drawer, on, -1.0), axis=-1, initial=-1.0)
    applies = np.minimum(level, in_drawer.take(rows, axis=-1)[..., None, :])
    return np.where(index.is_target, -1.0, applies)


def _overlap(boxes: ClearanceBoxes, index: DrawerObjectIndex, blocks: Blocks) -> Array:
    """How far blocks reach into the clearances, seen from above.

    The separating axis theorem in the plane: two rectangles overlap by the least of what they do
    along the axes of both.

    Returns:
        Shape (..., sides, blocks, targets).
    """
    flat, places, rows = blocks.flat, blocks.places, index.target_rows
    back = inverse_yaws(blocks.q, blocks.edges)
    target_back = _towards_base(back.take(rows, axis=-1))
    target_widths = half_widths(flat.take(rows, axis=-2), target_back)

    # Along the target's faces: from the middles of the clearances to those of the blocks.
    half_spans = target_widths.take(AXES, axis=-1).swapaxes(-1, -2) + boxes.depth
    middles = half_spans * TOWARDS[:, None]
    apart = places[..., None] - places.take(rows, axis=-1)[..., None, :]
    offset = turned(apart, target_back[..., None, :])
    offset = offset[..., None, :, :] - middles[..., None, :]
    block_widths = half_widths(flat[..., :, None, :], target_back[..., None, :])[..., None, :, :, :]
    gaps = along_axes(offset) - block_widths - boxes.halves

    # Along the faces of the block itself.
    turn = turned(back[..., None], target_back[..., None, :].conj())[..., None, :, :]
    own_gaps = along_axes(turned(offset, turn)) - boxes.spans_after(turn)
    own_gaps -= half_widths(flat, back)[..., None, :, None, :]
    separation = np.maximum(gaps, own_gaps)
    return -np.maximum(separation[..., 0], separation[..., 1])


def _towards_base(back: Complex) -> Complex:
    """The same up to quarter turns: the one that turns least."""
    steep = np.abs(back.imag) > np.abs(back.real)
    quarter = np.where(steep, back * 1j, back)
    return np.where(quarter.real < 0.0, -quarter, quarter)


@cache_latest
def ready_margins(state: State) -> tuple[DrawerObjectIndex, Array]:
    """How well the hand is over blocks, as margins in m, shape (..., blocks)."""
    index, data = DrawerObjectIndex.of(state.layout), state.data
    point = grasp_points(data.take(index.joints, axis=-1))
    aside = data.take(index.places, axis=-1) - point[..., None, :2]
    above = point[..., None, 2] - data.take(index.z, axis=-1)
    level = OVER_TOLERANCE - np.abs(above - OVER)
    return index, np.minimum(ASIDE_TOLERANCE - np.hypot(aside[..., 0], aside[..., 1]), level)
