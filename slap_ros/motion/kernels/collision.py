# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collision tests, as :mod:`slap_ros.motion.numpy_collision`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kernels.kinematics import place_links
from slap_ros.motion.kernels.separation import separated
from slap_ros.worlds.panda import JOINTS


@inner
def is_free(q: Joints, scene: CollisionScene) -> bool:
    """Whether a configuration is free: rad, shape (7,)."""
    frames = np.empty((JOINTS, 3, 4))
    place_links(q, frames)
    seen = np.empty(3)
    for shape in range(len(scene.links)):
        link, inside = frames[scene.links[shape]], scene.frames[shape]
        x, y, z = _moved(link, inside, 0), _moved(link, inside, 1), _moved(link, inside, 2)
        for obstacle in range(len(scene.sizes)):
            turn = scene.turns[obstacle]
            for i in range(3):
                seen[i] = (
                    x * turn[0, i] + y * turn[1, i] + z * turn[2, i] - scene.origins[obstacle, i]
                )
            near = _outside2(seen, scene.sizes[obstacle]) < scene.reaches2[shape, obstacle]
            if near and not separated(
                _turn_between(link, inside, turn),
                seen,
                scene.halves[shape],
                scene.sizes[obstacle],
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
def _outside2(point: Array, size: Array) -> float:
    """The squared distance of a point from a box."""
    x = max(abs(point[0]) - size[0], 0.0)
    y = max(abs(point[1]) - size[1], 0.0)
    z = max(abs(point[2]) - size[2], 0.0)
    distance2: float = x * x + y * y + z * z
    return distance2


@inner
def _turn_between(link: Array, inside: Array, obstacle: Array) -> Array:
    """The orientation of an obstacle seen from a frame in a link: shape (3, 3)."""
    shape, turn = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            shape[i, j] = (
                link[i, 0] * inside[0, j] + link[i, 1] * inside[1, j] + link[i, 2] * inside[2, j]
            )
    for i in range(3):
        for j in range(3):
            turn[i, j] = (
                shape[0, i] * obstacle[0, j]
                + shape[1, i] * obstacle[1, j]
                + shape[2, i] * obstacle[2, j]
            )
    return turn


@compiled
def free_flags(scene: CollisionScene, q: Joints) -> NDArray[np.bool_]:
    """Whether the configurations are free: shape (n, 7) to (n,)."""
    flags = np.empty(len(q), np.bool_)
    for i in range(len(q)):
        flags[i] = is_free(q[i], scene)
    return flags
