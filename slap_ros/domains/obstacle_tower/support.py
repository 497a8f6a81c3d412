# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: which thing supports which block. Lengths in m, base frame.

For one block b and one thing t (another block, the table or a target), in plain terms:

- b *touches* t if ``|bottom of b - top of t| <= TOUCHING``.
- b *covers* t if, seen from above and along both faces of t,
  ``|distance of the middles| <= half the width of b + half the width of t``.
- b is *on* a target if it touches it and its middle is at most CENTRED from the target's; on
  another block if it touches and covers it; on the table if so and it is on no target.
- There is *room* on a target or a block if no block touches and covers it; on the table, always.

Of many states, or as margins, numpy computes this; of one state, as truths, plain floats do: few
things are at a height to touch, and one call of numpy takes longer than to find out which.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from slap_ros.domains.classifiers import strictly
from slap_ros.domains.obstacle_tower.features import TowerObjectIndex
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
from slap_ros.domains.tabletop.scalar_box import ScalarBox
from slap_ros.relational import State
from slap_ros.relational.predicates import Bools, cache_latest
from slap_ros.relational.state import Array
from slap_ros.tiered_function import TieredFunction

TOUCHING = 0.004  # m, height over a thing at which a block still lies on it
CENTRED = 0.015  # m, distance from the target's middle at which a block still is in it


class SupportRelations(NamedTuple):
    """The relations of one state or of many, as margins in m."""

    objects: TowerObjectIndex
    on: Array  # of blocks on things, shape (..., blocks * things)
    room: Array  # for a block on things, shape (..., things)


@cache_latest
def support_relations(state: State) -> SupportRelations:
    """All margins at once, as predicates share most of the work."""
    objects, data = TowerObjectIndex.of(state.layout), state.data
    on, room = MARGINS.of(data.size // data.shape[-1])(objects, data)
    return SupportRelations(objects, on.reshape(*on.shape[:-2], -1), room)


# From objects and features, shape (..., features), to margins of blocks on things, m, shape
# (..., blocks, things), and of room for a block on things, m, shape (..., things).
Margins = Callable[[TowerObjectIndex, Array], tuple[Array, Array]]


def margins(objects: TowerObjectIndex, data: Array) -> tuple[Array, Array]:
    """What lies on what, as margins, by numpy; see :data:`Margins`.

    Horizontal vectors are complex numbers: turned by a product, seen along both axes at once.

    Args:
        objects: Where the features of things are.
        data: Features of one state or of many, shape (..., features).
    """
    blocks = slice(objects.blocks)
    q = data.take(objects.quaternions, axis=-1)
    edges = unit_edges(q) * data.take(objects.halves, axis=-1)

    z, height = data.take(objects.z, axis=-1), np.add.reduce(np.abs(edges[..., 6:]), axis=-1)
    gap = (z - height)[..., blocks, None] - (z + height)[..., None, :]
    touches = steepened(TOUCHING - np.abs(gap))

    places = complex_of(data.take(objects.places, axis=-1))[..., 0]
    offset = places[..., blocks, None] - places[..., None, :]
    covers = _covers(blocks, offset, q, edges)

    is_movable = data.take(objects.is_movable, axis=-1) > 0.5
    is_target = data.take(objects.is_target, axis=-1) > 0.5
    centred = CENTRED - np.hypot(offset.real, offset.imag)
    to_target = np.where(is_target[..., None, :], centred, -1.0)[..., objects.blocks :]
    off_target = strictly(-np.maximum.reduce(to_target, axis=-1, initial=-1.0))[..., None]
    on_table = np.minimum(covers, off_target)
    off_targets = np.where(is_movable[..., None, :], covers, on_table)
    sideways = np.where(is_target[..., None, :], centred, off_targets)
    on = np.minimum(touches, sideways)

    over = np.maximum.reduce(np.minimum(touches, covers), axis=-2, initial=-1.0)
    return on, np.where(is_movable | is_target, strictly(-over), 1.0)


def _compiled_margins() -> Margins:
    from slap_ros.domains.obstacle_tower import kernels

    def compiled(objects: TowerObjectIndex, data: Array) -> tuple[Array, Array]:
        rows = data.reshape(-1, data.shape[-1])
        movable, target = (
            rows.take(labels, axis=-1) > 0.5 for labels in (objects.is_movable, objects.is_target)
        )
        boxes = rows.take(objects.boxes, axis=-1)
        on, room = kernels.margins(boxes, objects.blocks, movable, target)
        batch = data.shape[:-1]
        return on.reshape(*batch, *on.shape[1:]), room.reshape(*batch, -1)

    return compiled


MARGINS: TieredFunction[Margins] = TieredFunction(margins, _compiled_margins)


def _covers(blocks: slice, offset: Complex, q: Array, edges: Array) -> Array:
    """How far blocks cover things, seen along the axes of the thing: shape (..., blocks, things).

    Args:
        blocks: Slice of the things that selects the blocks.
        offset: Offsets from things to blocks, m, shape (..., blocks, things).
        q: Parts of the things' quaternions, shape (..., things, 4).
        edges: Edges of the things, m, shape (..., things, 9), as ``TO_EDGES`` gives them.
    """
    back = inverse_yaws(q, edges)[..., None, :]
    width = half_widths(complex_of(edges[..., :6])[..., None, :], back)
    own_width = np.diagonal(width, axis1=-3, axis2=-2).swapaxes(-1, -2)[..., None, :, :]
    ahead_aside = width[..., blocks, :, :] + own_width - along_axes(turned(offset, back))
    return np.minimum(ahead_aside[..., 0], ahead_aside[..., 1])


class SupportTruths(NamedTuple):
    """The relations of a single state, as truths, and what is held."""

    objects: TowerObjectIndex
    on: Bools  # of blocks on things, shape (blocks * things,)
    room: Bools  # for a block on things, shape (things,)
    held: Bools  # shape (blocks,)
    empty: Bools  # whether none is, shape (1,)


@cache_latest
def support_truths(state: State) -> SupportTruths:
    """The truths of a single state; only what is at a height to touch is examined closely."""
    objects, data = TowerObjectIndex.of(state.layout), state.data
    is_movable, is_target, held = (
        data.take(labels) > 0.5 for labels in (objects.is_movable, objects.is_target, objects.held)
    )
    support = SUPPORT.of(1)
    on, room = support(data.take(objects.boxes), objects.blocks, is_movable, is_target)
    return SupportTruths(objects, on.reshape(-1), room, held, np.array([not held.any()]))


# From boxes, blocks before surfaces, the number of blocks, and labels of all, to which block is on
# which thing, shape (blocks, things), and which thing has room for a block, shape (things,).
Support = Callable[[Array, int, Bools, Bools], tuple[Bools, Bools]]


def support(boxes: Array, blocks: int, is_movable: Bools, is_target: Bools) -> tuple[Bools, Bools]:
    """What lies on what, by plain floats; see :data:`Support`.

    Args:
        boxes: Arguments of a ``ScalarBox`` for each thing, shape (things, 10).
        blocks: Number of blocks, which come first.
        is_movable: Whether each thing is, shape (things,).
        is_target: Whether each thing is, shape (things,).
    """
    things = [ScalarBox(*box) for box in boxes.tolist()]
    targets = [thing for i, thing in enumerate(things) if i >= blocks and is_target[i]]
    on = np.zeros((blocks, len(things)), dtype=bool)
    room = np.ones(len(things), dtype=bool)
    for number, block in enumerate(things[:blocks]):
        for i, thing in enumerate(things):
            if abs(block.bottom - thing.top) > TOUCHING:
                continue
            covers = block.covers(thing)
            if is_target[i]:
                on[number, i] = _is_centred(block, thing)
            else:
                on[number, i] = covers and (is_movable[i] or not _is_on_any(block, targets))
            if covers and (is_movable[i] or is_target[i]):
                room[i] = False
    return on, room


def _compiled_support() -> Support:
    from slap_ros.domains.obstacle_tower import kernels

    return kernels.support


SUPPORT: TieredFunction[Support] = TieredFunction(support, _compiled_support)


def _is_on_any(block: ScalarBox, targets: Sequence[ScalarBox]) -> bool:
    return any(_is_centred(block, target) for target in targets)


def _is_centred(block: ScalarBox, target: ScalarBox) -> bool:
    return math.hypot(block.x - target.x, block.y - target.y) <= CENTRED
