# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collision tests, as :mod:`slap_ros.motion.numpy_collision`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.geometry.pose import Vector
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kernels.kinematics import place_links
from slap_ros.motion.kernels.separation import separated
from slap_ros.motion.kernels.vectors import Matrix, applied, dot, matrix, transposed, vector
from slap_ros.worlds.panda import JOINTS


@inner
def is_free(q: Joints, scene: CollisionScene) -> bool:
    """Whether a configuration is free: rad, shape (7,)."""
    frames = np.empty((JOINTS, 3, 4))
    place_links(q, frames)
    for shape in range(len(scene.links) - 1, -1, -1):  # the hand, which mostly collides first
        link, inside = frames[scene.links[shape]], scene.frames[shape]
        centre = _moved(link, inside, 0), _moved(link, inside, 1), _moved(link, inside, 2)
        for obstacle in range(len(scene.sizes)):
            if _distance2(centre, scene.middles[obstacle]) >= scene.far2[shape, obstacle]:
                continue
            turn, size = matrix(scene.turns[obstacle]), vector(scene.sizes[obstacle])
            seen = _seen(centre, turn, scene.origins[obstacle])
            near = _outside2(seen, size) < scene.reaches2[shape, obstacle]
            if near and not separated(
                _turn_between(link, inside, turn),
                seen,
                vector(scene.halves[shape]),
                size,
                scene.clearances[shape],
            ):
                return False
    return True


@inner
def _moved(link: Array, inside: Array, row: int) -> float:
    """One coordinate of where a link takes the origin of a frame in it."""
    turned = link[row, 0] * inside[0, 3] + link[row, 1] * inside[1, 3] + link[row, 2] * inside[2, 3]
    moved: float = turned + link[row, 3]
    return moved


@inner
def _distance2(a: Vector, b: Array) -> float:
    """The squared distance of two points."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    distance2: float = x * x + y * y + z * z
    return distance2


@inner
def _seen(point: Vector, turn: Matrix, origin: Array) -> Vector:
    """A point seen from an obstacle."""
    first, second, third = transposed(turn)
    return (
        dot(point, first) - origin[0],
        dot(point, second) - origin[1],
        dot(point, third) - origin[2],
    )


@inner
def _outside2(point: Vector, size: Vector) -> float:
    """The squared distance of a point from a box."""
    x = max(abs(point[0]) - size[0], 0.0)
    y = max(abs(point[1]) - size[1], 0.0)
    z = max(abs(point[2]) - size[2], 0.0)
    distance2: float = x * x + y * y + z * z
    return distance2


@inner
def _turn_between(link: Array, inside: Array, obstacle: Matrix) -> Matrix:
    """The orientation of an obstacle seen from a frame in a link."""
    first, second, third = transposed(matrix(inside))
    shape = (
        applied(matrix(link), first),
        applied(matrix(link), second),
        applied(matrix(link), third),
    )  # columns of the frame's orientation
    first, second, third = transposed(obstacle)
    return transposed((applied(shape, first), applied(shape, second), applied(shape, third)))


@compiled
def free_flags(scene: CollisionScene, q: Joints) -> NDArray[np.bool_]:
    """Whether the configurations are free: shape (n, 7) to (n,)."""
    flags = np.empty(len(q), np.bool_)
    for i in range(len(q)):
        flags[i] = is_free(q[i], scene)
    return flags
