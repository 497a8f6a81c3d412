# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortest way out of a box: the minimum translation vector of two boxes that overlap."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from slap_ros.geometry.oriented_box import PARALLEL, OrientedBox
from slap_ros.geometry.pose import Vector, cross, dot, rotate

EDGES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def minimum_translation(box: OrientedBox, other: OrientedBox) -> Vector | None:
    """The shortest translation of a box out of another one.

    It is along that axis of the separating axis theorem on which the shadows of the two overlap
    least.

    Args:
        box: Box that is moved.
        other: Box that stays.

    Returns:
        The translation after which the two just touch, m; None if they share no point.
    """
    px, py, pz = box.pose.position
    qx, qy, qz = other.pose.position
    offset = (px - qx, py - qy, pz - qz)
    least: tuple[float, Vector] = (math.inf, offset)
    for axis in _axes(box, other):
        apart = dot(axis, offset)
        overlap = box.half_extent(axis) + other.half_extent(axis) - abs(apart)
        if overlap < 0.0:
            return None
        if overlap < least[0]:
            least = overlap, axis if apart >= 0.0 else (-axis[0], -axis[1], -axis[2])
    depth, (x, y, z) = least
    return (depth * x, depth * y, depth * z)


def _axes(box: OrientedBox, other: OrientedBox) -> Iterator[Vector]:
    """The axes that may separate two boxes, of length 1: along edges, and across pairs of them."""
    of_box = [rotate(box.pose.quaternion, edge) for edge in EDGES]
    of_other = [rotate(other.pose.quaternion, edge) for edge in EDGES]
    yield from of_box
    yield from of_other
    for a, b in product(of_box, of_other):
        x, y, z = cross(a, b)
        length2 = x * x + y * y + z * z
        if length2 >= PARALLEL:
            length = math.sqrt(length2)
            yield (x / length, y / length, z / length)
