# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the arm, and what it holds, is clear of boxes: for many configurations at once."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.box_separation import Flags, separated
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.motion.arm_shapes import ARM_SHAPES, BASE, BEHIND_ELBOW
from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, LAST_LINK, arm_frames, matrix
from slap_ros.worlds.panda import FINGER_OPEN, JOINTS, LINKS, link_poses

MARGIN = 0.005  # m, that the arm keeps from everything
HELD_MARGIN = -0.001  # m: a held box may rest on what it is lifted from or set down on
_BATCH = 512  # configurations at once: their arrays stay in the cache


class CollisionChecker:
    """Tells free configurations from others, and errs on the safe side.

    The moving links, as rounded boxes, and the held box are tested against every obstacle, and
    what comes behind the elbow against the arm's base. Other collisions of the arm with itself are
    not looked for. Obstacles that the arm may touch, like a block that it is about to grasp, are
    left out by the caller.
    """

    def __init__(
        self,
        obstacles: Sequence[OrientedBox],
        *,
        held: OrientedBox | None = None,
        finger: float = FINGER_OPEN,
        margin: float = MARGIN,
        held_margin: float = HELD_MARGIN,
        base: bool = True,
    ) -> None:
        """Lay out the shapes of the arm, the held box and the obstacles.

        Args:
            obstacles: Boxes to keep clear of, in the base's frame.
            held: Box that the hand holds; its pose is in the frame of the grasp point.
            finger: Distance of each finger from the middle, m.
            margin: Distance that the links keep from the obstacles, m.
            held_margin: Distance that the held box keeps, m; below 0, how deep it may overlap.
            base: Whether the arm's base is in the way of forearm, hand and held box.
        """
        links, frames, halves, clearances = _moving_shapes(held, finger, margin, held_margin)
        self._links, self._frames, self._halves = links, frames, halves
        self._clearances = clearances  # m, from a shape's inner box to an obstacle
        boxes = [*obstacles, BASE] if base else list(obstacles)
        poses = np.array([matrix(box.pose) for box in boxes]).reshape(-1, 4, 4)
        self._turns = poses[:, :3, :3]
        self._sizes = np.array([box.half for box in boxes]).reshape(-1, 3)
        # From a shape's centre to an obstacle that it may touch, m².
        reaches = np.linalg.norm(halves, axis=-1) + clearances
        self._reaches2 = np.repeat(reaches[:, None] ** 2, len(boxes), axis=1)
        if base:
            self._reaches2[:BEHIND_ELBOW, -1] = 0.0  # never tested: these are fixed to it
        # Seen from all obstacles, a point is (point @ _axes - _origins), three numbers each.
        self._axes = self._turns.transpose(1, 0, 2).reshape(3, -1)
        self._origins = np.einsum("kij,ki->kj", self._turns, poses[:, :3, 3])
        self.key = self._digest()

    def _digest(self) -> bytes:
        digest = hashlib.blake2b(digest_size=16)
        parts = (self._frames, self._halves, self._clearances)
        for array in (*parts, self._turns, self._sizes, self._origins, self._reaches2):
            digest.update(str(array.shape).encode() + array.tobytes())
        return digest.digest()

    def __call__(self, q: Joints) -> Flags:
        """Whether the configurations are free: shape (..., 7) to (...)."""
        flat = np.asarray(q).reshape(-1, JOINTS)
        parts = [self._free(flat[i : i + _BATCH]) for i in range(0, len(flat), _BATCH)]
        free = parts[0] if len(parts) == 1 else np.concatenate([np.ones(0, bool), *parts])
        return free.reshape(np.shape(q)[:-1])

    def _free(self, q: Joints) -> Flags:
        links = arm_frames(q)
        # Where the shapes' centres are; how they are turned matters only for the near ones.
        centres = np.einsum("nsij,sj->nsi", links[:, self._links, :3], self._frames[..., 3])
        # One product of matrices, not one a configuration.
        seen = (centres.reshape(-1, 3) @ self._axes).reshape(*centres.shape[:2], -1, 3)
        seen -= self._origins
        outside = np.abs(seen)
        outside -= self._sizes
        np.maximum(outside, 0.0, out=outside)
        distance2 = np.einsum("...i,...i", outside, outside)
        near = distance2 < self._reaches2
        free = np.ones(len(q), bool)
        if near.any():
            which, shape, obstacle = near.nonzero()
            turns = np.matmul(links[which, self._links[shape], :3, :3], self._frames[shape, :3, :3])
            turn = np.matmul(turns.swapaxes(1, 2), self._turns[obstacle])
            offset = seen[which, shape, obstacle]
            sizes = self._halves[shape], self._sizes[obstacle]
            free[which[~separated(turn, offset, *sizes, self._clearances[shape])]] = False
        return free


def _moving_shapes(
    held: OrientedBox | None, finger: float, margin: float, held_margin: float
) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """The arm's shapes and the held box, each fixed to one of link 1 to link 7.

    Returns:
        Index of that link (0 for link 1), frame in it, half extents, and distance to be kept.
    """
    shapes = _arm_shapes(finger)
    links, frames = [link for link, _ in shapes], [frame for _, frame in shapes]
    halves = [shape.box.half for shape in ARM_SHAPES]
    clearances = [shape.radius + margin for shape in ARM_SHAPES]
    if held is not None:
        links.append(LAST_LINK - 1)
        frames.append(matrix(GRASP_IN_LAST_LINK.compose(held.pose)))
        halves.append(held.half)
        clearances.append(held_margin)
    return (
        np.array(links, dtype=np.intp),
        cast(Array, np.stack(frames)),
        np.array(halves),
        np.array(clearances),
    )


@lru_cache(maxsize=64)
def _arm_shapes(finger: float) -> tuple[tuple[int, Array], ...]:
    """The link's index (0 for link 1) and the frame in that link of each of the arm's shapes."""
    zero = link_poses((0.0,) * JOINTS, finger)
    found = []
    for shape in ARM_SHAPES:
        index = LINKS.index(shape.link)
        carrier = min(index, LAST_LINK)  # link 7 carries hand and fingers
        frame = matrix(zero[carrier].inverse().compose(zero[index]).compose(shape.box.pose))
        found.append((carrier - 1, frame))
    return tuple(found)
