# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""In which order bodies are painted, so that the nearer ones hide the farther ones.

A plane between two boxes tells which of them cannot hide the other (Newell, Newell and Sancha
1972, with boxes in the place of polygons).
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import VisibleBody
from slap_ros.drawing.projection import EDGE_ON, Projection, extents, pose_of
from slap_ros.geometry.pose import rotation_matrix

TOUCHING_M = 1e-3  # by which boxes may be inside one another and still have a plane between them

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def painting_order(
    bodies: Sequence[VisibleBody], view: Projection, ranks: Sequence[Any]
) -> list[int]:
    """The numbers of bodies, from back to front.

    Args:
        bodies: Bodies: boxes, or of triangles, which count as the boxes around them.
        view: Projection that the bodies are seen in.
        ranks: Rank of each body, and maybe of further items that hide nothing and are not hidden.
            Where nothing else decides, the lower rank comes first.

    Returns:
        Numbers of what has ranks, each once.
    """
    followers: list[list[int]] = [[] for _ in ranks]
    waiting = [0] * len(ranks)
    for behind, ahead in np.argwhere(_hidden_by(bodies, view)).tolist():
        followers[behind].append(ahead)
        waiting[ahead] += 1
    ready = [(rank, i) for i, rank in enumerate(ranks) if not waiting[i]]
    heapify(ready)
    left, order = set(range(len(ranks))), []
    while left:
        # In a circle of bodies each of which hides the next one, somebody has to be first.
        number = heappop(ready)[1] if ready else min(left, key=lambda i: (ranks[i], i))
        if number not in left:
            continue
        left.remove(number)
        order.append(number)
        for i in followers[number]:
            waiting[i] -= 1
            if not waiting[i]:
                heappush(ready, (ranks[i], i))
    return order


def _hidden_by(bodies: Sequence[VisibleBody], view: Projection) -> Flags:
    """Whether a body may be hidden by another one and cannot hide it, shape (n, n)."""
    if not bodies:
        return np.zeros((0, 0), dtype=bool)
    turns = np.array([rotation_matrix(pose_of(body).quaternion) for body in bodies])
    local = np.array([extents(body) for body in bodies])  # (n, 3, lowest and highest)
    half = 0.5 * (local[..., 1] - local[..., 0])
    middle = np.array([body.position for body in bodies])
    middle += np.einsum("nij,nj->ni", turns, local.mean(axis=2))
    cannot = _apart_on_screen(middle, turns, half, view)  # [a, b]: a cannot hide b
    toward = np.array(view.toward)
    for axis in range(3):
        normals = turns[:, :, axis]  # of each body
        way = np.einsum("ai,abi->ab", normals, middle[None] - middle[:, None])
        reach = half[:, axis, None] + np.einsum(
            "abj,bj->ab", np.abs(np.einsum("ai,bij->abj", normals, turns)), half
        )
        apart = np.abs(way) > reach - TOUCHING_M
        facing = normals @ toward
        side = np.sign(way) * np.where(np.abs(facing) > EDGE_ON, np.sign(facing), 0.0)[:, None]
        cannot |= apart & (side >= 0.0)
        cannot |= (apart & (side <= 0.0)).T
    hidden: Flags = cannot & ~cannot.T
    return hidden


def _apart_on_screen(middle: Floats, turns: Floats, half: Floats, view: Projection) -> Flags:
    """Whether two bodies do not overlap in the picture, as far as the rectangles around tell."""
    apart = np.zeros((len(middle), len(middle)), dtype=bool)
    for axis in np.array([view.right, view.up]):
        at = middle @ axis
        reach = (np.abs(np.einsum("i,nij->nj", axis, turns)) * half).sum(axis=1)
        apart |= np.abs(at[:, None] - at) > reach[:, None] + reach
    return apart
