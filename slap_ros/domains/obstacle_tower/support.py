# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: what lies on what. Lengths in m, base frame.

Of many states, or as margins, by numpy; of one state, as truths, in plain floats: few things are
at a height to touch, and one call of numpy takes longer than to find out which.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slap_ros.domains.obstacle_tower.features import TowerObjectIndex
from slap_ros.domains.tabletop.footprints import (
    TO_EDGES,
    along_axes,
    complex_of,
    strictly,
    turned_back,
    unpinched,
    widths,
)
from slap_ros.domains.tabletop.scalar_box import ScalarBox
from slap_ros.relational import State
from slap_ros.relational.predicates import Bools, cache_latest
from slap_ros.relational.state import Array

TOUCHING = 0.004  # m, height over a thing at which a block still lies on it
CENTRED = 0.015  # m, distance from the target's middle at which a block still is in it


class SupportRelations(NamedTuple):
    """How everything lies in a state, as margins in m."""

    things: TowerObjectIndex
    on: Array  # of blocks on things, shape (..., blocks * things)
    room: Array  # for a block on things, shape (..., things)


@cache_latest
def support_relations(state: State) -> SupportRelations:
    """How everything lies: all at once, as predicates share most of it.

    Horizontal vectors are complex numbers: turned by a product, seen along both axes at once.
    """
    things, data = TowerObjectIndex.of(state.layout), state.data
    blocks = slice(things.blocks)
    q = data.take(things.quaternions, axis=-1)
    products = (q[..., None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    edges = products @ TO_EDGES * data.take(things.halves, axis=-1)
    is_movable = data.take(things.is_movable, axis=-1) > 0.5
    is_target = data.take(things.is_target, axis=-1) > 0.5

    # A block touches what its lowest point is at the height of.
    z, height = data.take(things.z, axis=-1), np.add.reduce(np.abs(edges[..., 6:]), axis=-1)
    gap = (z - height)[..., blocks, None] - (z + height)[..., None, :]
    touches = unpinched(TOUCHING - np.abs(gap))

    # It covers what it is over, seen along the axes of that thing.
    places = complex_of(data.take(things.places, axis=-1))[..., 0]
    way = places[..., blocks, None] - places[..., None, :]
    back = turned_back(q, edges)[..., None, :]
    width = widths(complex_of(edges[..., :6])[..., None, :], back)
    own_width = np.diagonal(width, axis1=-3, axis2=-2).swapaxes(-1, -2)[..., None, :, :]
    ahead_aside = width[..., blocks, :, :] + own_width - along_axes(way * back)
    covers = np.minimum(ahead_aside[..., 0], ahead_aside[..., 1])

    # It lies in the middle of a target; elsewhere on the table; or on a part of another block.
    centred = CENTRED - np.abs(way)
    to_target = np.where(is_target[..., None, :], centred, -1.0)[..., things.blocks :]
    elsewhere = strictly(-np.maximum.reduce(to_target, axis=-1, initial=-1.0))[..., None]
    on_table = np.minimum(covers, elsewhere)
    off_targets = np.where(is_movable[..., None, :], covers, on_table)
    sideways = np.where(is_target[..., None, :], centred, off_targets)
    on = np.minimum(touches, sideways)

    # On the table there is always room; on targets and blocks for one block only.
    over = np.maximum.reduce(np.minimum(touches, covers), axis=-2, initial=-1.0)
    room = np.where(is_movable | is_target, strictly(-over), 1.0)
    return SupportRelations(things, on.reshape(*on.shape[:-2], -1), room)


class SupportTruths(NamedTuple):
    """The same of a single state, as truths, and what is held."""

    things: TowerObjectIndex
    on: Bools  # of blocks on things, shape (blocks * things,)
    room: Bools  # for a block on things, shape (things,)
    held: Bools  # shape (blocks,)
    empty: Bools  # whether none is, shape (1,)


@cache_latest
def support_truths(state: State) -> SupportTruths:
    """What lies on what in a single state: what is at the right height is looked at closely."""
    things, values = TowerObjectIndex.of(state.layout), state.data.tolist()
    boxes = [ScalarBox(*read(values)) for read in things.boxes]
    is_movable, is_target, held = (
        [values[i] > 0.5 for i in label.tolist()]
        for label in (things.is_movable, things.is_target, things.held)
    )
    targets = [boxes[i] for i in range(things.blocks, len(boxes)) if is_target[i]]
    on = np.zeros((things.blocks, len(boxes)), dtype=bool)
    room = np.ones(len(boxes), dtype=bool)
    for number, block in enumerate(boxes[: things.blocks]):
        for i, thing in enumerate(boxes):
            if abs(block.bottom - thing.top) > TOUCHING:
                continue
            covers = block.covers(thing)
            if is_target[i]:
                on[number, i] = _is_centred(block, thing)
            else:
                on[number, i] = covers and (
                    is_movable[i] or not any(_is_centred(block, target) for target in targets)
                )
            if covers and (is_movable[i] or is_target[i]):
                room[i] = False
    return SupportTruths(
        things, on.reshape(-1), room, np.array(held, bool), np.array([not any(held)])
    )


def _is_centred(block: ScalarBox, target: ScalarBox) -> bool:
    return math.hypot(block.x - target.x, block.y - target.y) <= CENTRED
