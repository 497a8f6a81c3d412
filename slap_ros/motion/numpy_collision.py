# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collision tests of many configurations at once, in numpy.

Sums are written out, so that their bits are those of the compiled kernels on every processor.
"""

from __future__ import annotations

import numpy as np

from slap_ros.geometry.box_separation import Array, Flags, dot, separated
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Joints
from slap_ros.motion.numpy_kinematics import arm_frames

_BATCH = 512  # configurations at once: their arrays stay in the cache


def free_flags(scene: CollisionScene, q: Joints) -> Flags:
    """Whether the configurations are free: shape (n, 7) to (n,)."""
    parts = [_free(scene, q[i : i + _BATCH]) for i in range(0, len(q), _BATCH)]
    return parts[0] if len(parts) == 1 else np.concatenate([np.ones(0, bool), *parts])


def _free(scene: CollisionScene, q: Joints) -> Flags:
    links = arm_frames(q)[:, scene.links, :3]
    # Where the shapes' centres are; how they are turned matters only for the near ones.
    centres = dot(links[..., :3], scene.frames[:, None, :3, 3]) + links[..., 3]
    seen = dot(centres[:, :, None, None, :], scene.turns.swapaxes(1, 2)) - scene.origins
    outside = np.maximum(np.abs(seen) - scene.sizes, 0.0)
    near = dot(outside, outside) < scene.reaches2
    free = np.ones(len(q), bool)
    if near.any():
        which, shape, obstacle = near.nonzero()
        turns = _product(links[which, shape, :, :3], scene.frames[shape, :3, :3])
        turn = _product(turns.swapaxes(1, 2), scene.turns[obstacle])
        offset = seen[which, shape, obstacle]
        sizes = scene.halves[shape], scene.sizes[obstacle]
        free[which[~separated(turn, offset, *sizes, scene.clearances[shape])]] = False
    return free


def _product(a: Array, b: Array) -> Array:
    """The products of matrices: shapes (m, 3, 3)."""
    return dot(a[:, :, None, :], b.swapaxes(1, 2)[:, None])
