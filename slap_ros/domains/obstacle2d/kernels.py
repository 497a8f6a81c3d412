# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D as compiled code, for many worlds: the arithmetic of ``dynamics.py``, one by one.

Where a comment is missing here, it is there: each function has its name, and the same bits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.domains.classifiers import TINY
from slap_ros.relational.state import Array

Flags = NDArray[np.bool_]
Numbers = NDArray[np.intp]


class Bodies(NamedTuple):
    """Robot and blocks of one world, which a step changes."""

    robot: Array  # x and y, m, shape (2,)
    x: Array  # m, shape (blocks,)
    y: Array  # m, shape (blocks,)
    held: Flags  # shape (blocks,)
    waits: Numbers  # to be pushed: 1 to the right, -1 to the left, shape (blocks,)


class Sizes(NamedTuple):
    """The constants of the world, m."""

    block: float
    contact: float  # overlap below which bodies only touch
    rounding: float  # overlap that does not push
    reach: float  # sideways between gripper and block, at which it grasps
    gap: float  # height of the gripper over a block, at which it grasps


@compiled
def step(
    data: Array,
    actions: Array,
    columns: tuple[Numbers, Numbers, Numbers, Numbers],
    commands: tuple[float, float],
    sizes: Sizes,
) -> Array:
    """See :func:`slap_ros.domains.obstacle2d.dynamics.step`.

    Args:
        data: States, shape (worlds, features). Not changed.
        actions: Action of each world, shape (worlds, 3).
        columns: Columns of the robot's place, and of the blocks' x, y and held.
        commands: Gripper commands beyond which it closes and opens.
        sizes: Constants of the world.
    """
    place, x, y, held = columns
    blocks = len(x)
    bodies = Bodies(
        np.empty(2),
        np.empty(blocks),
        np.empty(blocks),
        np.empty(blocks, np.bool_),
        np.empty(blocks, np.intp),
    )
    after = data.copy()
    for i in range(len(data)):
        row = after[i]
        bodies.robot[0], bodies.robot[1] = row[place[0]], row[place[1]]
        for b in range(blocks):
            bodies.x[b], bodies.y[b], bodies.held[b] = row[x[b]], row[y[b]], row[held[b]] > 0.5
        _grip(bodies, actions[i, 2], commands, sizes)
        _move(bodies, actions[i, 0], actions[i, 1], sizes)
        row[place[0]], row[place[1]] = bodies.robot[0], bodies.robot[1]
        for b in range(blocks):
            row[x[b]], row[y[b]], row[held[b]] = bodies.x[b], bodies.y[b], bodies.held[b]
    return after


@inner
def _held_block(bodies: Bodies) -> int:
    """Number of the block that is held, of which there is one at most; -1 without."""
    for b in range(len(bodies.held)):
        if bodies.held[b]:
            return b
    return -1


@inner
def _grip(bodies: Bodies, command: float, commands: tuple[float, float], sizes: Sizes) -> None:
    close, opens = commands
    carried = _held_block(bodies)
    if carried < 0 and command > close:
        nearest = _graspable(bodies, sizes)
        if nearest >= 0:
            bodies.held[nearest] = True
    if carried >= 0 and command < opens and not _is_over_any(bodies, bodies.x[carried], sizes):
        bodies.y[carried] = 0.0
        bodies.held[carried] = False


@inner
def _graspable(bodies: Bodies, sizes: Sizes) -> int:
    nearest, least = -1, np.inf
    for b in range(len(bodies.x)):
        sideways = abs(bodies.x[b] - bodies.robot[0])
        gap = bodies.robot[1] - bodies.y[b] - sizes.block
        within = sideways <= sizes.reach and gap >= -sizes.contact and gap <= sizes.gap
        if within and sideways < least:
            nearest, least = b, sideways
    return nearest


@inner
def _is_over_any(bodies: Bodies, x: float, sizes: Sizes) -> bool:
    """Whether a body at a place would stand over a block that is not held."""
    for b in range(len(bodies.x)):
        if abs(bodies.x[b] - x) < sizes.block - sizes.contact and not bodies.held[b]:
            return True
    return False


@inner
def _move(bodies: Bodies, aside: float, up: float, sizes: Sizes) -> None:
    carried = _held_block(bodies)
    offset_x = bodies.x[carried] - bodies.robot[0] if carried >= 0 else 0.0
    offset_y = bodies.y[carried] - bodies.robot[1] if carried >= 0 else 0.0
    start, height = bodies.robot[0] + offset_x, bodies.robot[1] + offset_y
    gone_x = _room_aside(bodies, start, height, offset_x, aside, sizes)
    pusher = start + gone_x
    if height < sizes.block - sizes.contact:
        _push(bodies, start, pusher, sizes)
    floor = sizes.block if _is_over_any(bodies, pusher, sizes) else 0.0
    ceiling = 1.0 + offset_y
    gone_y = min(max(up, min(floor - height, 0.0)), max(ceiling - height, 0.0))
    if carried >= 0:
        bodies.x[carried] += gone_x
        bodies.y[carried] += gone_y
    bodies.robot[0] += gone_x
    bodies.robot[1] += gone_y


@inner
def _room_aside(
    bodies: Bodies, start: float, height: float, offset: float, aside: float, sizes: Sizes
) -> float:
    """How far the pusher goes aside: between the walls, with the blocks that it pushes."""
    right = left = 0
    if height < sizes.block - sizes.contact:
        for b in range(len(bodies.x)):
            if not bodies.held[b]:
                right += bodies.x[b] > start
                left += not bodies.x[b] > start
    lowest = max(sizes.block * left, max(offset, 0.0))
    highest = min(1.0 - sizes.block * right, 1.0 + min(offset, 0.0))
    return min(max(aside, min(lowest - start, 0.0)), max(highest - start, 0.0))


@inner
def _push(bodies: Bodies, start: float, pusher: float, sizes: Sizes) -> None:
    """Shift blocks to either side until none overlaps the pusher or its neighbour."""
    for b in range(len(bodies.x)):
        bodies.waits[b] = 0 if bodies.held[b] else (1 if bodies.x[b] > start else -1)
    for side in (1, -1):
        edge = side * pusher + sizes.block
        block = _next_to_push(bodies, side)
        while block >= 0:
            here = side * bodies.x[block]
            moved = edge if edge > here + sizes.rounding else here
            bodies.x[block] = side * moved
            bodies.waits[block] = 0
            edge = moved + sizes.block
            block = _next_to_push(bodies, side)


@inner
def _next_to_push(bodies: Bodies, side: int) -> int:
    """Number of the block nearest to the pusher that still waits on a side; -1 without."""
    block = -1
    for b in range(len(bodies.x)):
        if bodies.waits[b] == side and (block < 0 or side * bodies.x[b] < side * bodies.x[block]):
            block = b
    return block


class RelationConstants(NamedTuple):
    """Constants of the relations, m but for the last."""

    block: float
    rest: float  # height over the table at which a block still rests on it
    overlap: float  # how far a block may reach over an edge without overlapping the area
    steepness: float  # 1, of the margin of what does not rest


@compiled
def relations(
    data: Array,
    of_blocks: tuple[Numbers, ...],
    of_surfaces: tuple[Numbers, ...],
    tolerances: RelationConstants,
) -> tuple[Array, Array, Array, Array]:
    """See :func:`slap_ros.domains.obstacle2d.model.relations_by_numpy`.

    Args:
        data: States, shape (n, features).
        of_blocks: Columns of the blocks' x, y and held.
        of_surfaces: Columns of the surfaces' x, width and is_target.
        tolerances: Constants.
    """
    x, y, held = of_blocks
    middle, width, is_target = of_surfaces
    rest, on_table = np.empty((len(data), len(x))), np.empty((len(data), len(x)))
    distance = np.empty((len(data), len(x), len(middle)))
    overlap = np.empty((len(data), len(x), len(middle)))
    for i in range(len(data)):
        row = data[i]
        for b in range(len(x)):
            height = tolerances.block if row[held[b]] > 0.5 else row[y[b]]
            margin = tolerances.rest - height
            rest[i, b] = max(margin, tolerances.steepness * margin)
            most = -np.inf
            for s in range(len(middle)):
                distance[i, b, s] = abs(row[x[b]] - row[middle[s]])
                half_widths = (tolerances.block + row[width[s]]) / 2
                reach = half_widths - distance[i, b, s] - tolerances.overlap
                reach = reach if row[is_target[s]] > 0.5 else -1.0
                overlap[i, b, s] = min(rest[i, b], reach)
                most = max(most, reach)
            on_table[i, b] = min(rest[i, b], -min(rest[i, b], most) - TINY)
    return rest, distance, overlap, on_table


@compiled
def on_margins(
    data: Array,
    relations: tuple[Array, Array, Array],
    numbers: tuple[Numbers, Numbers],
    of_surfaces: tuple[Numbers, Numbers],
    sizes: tuple[float, float],
) -> Array:
    """See :func:`slap_ros.domains.obstacle2d.model.on_margin_by_numpy`.

    Args:
        data: States, shape (n, features).
        relations: Rest, distance and on_table of these states.
        numbers: Numbers of the blocks and of the surfaces that are asked about.
        of_surfaces: Columns of width and is_target of the surfaces that are asked about.
        sizes: A block's, and how far one may reach over an edge, m.
    """
    rest, distance, on_table = relations
    blocks, surfaces = numbers
    width, is_target = of_surfaces
    block_size, tolerance = sizes
    margins = np.empty((len(data), len(blocks)))
    for i in range(len(data)):
        for k in range(len(blocks)):
            b = blocks[k]
            if data[i, is_target[k]] > 0.5:
                room = (data[i, width[k]] - block_size) / 2 + tolerance
                inside = room - distance[i, b, surfaces[k]]
                missing = min(rest[i, b], 0.0) + min(inside, 0.0)
                margins[i, k] = missing if missing < 0.0 else min(rest[i, b], inside)
            else:
                margins[i, k] = on_table[i, b]
    return margins
