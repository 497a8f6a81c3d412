# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shapes that move with the arm and the boxes around it, as arrays."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.box_separation import dot
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.motion.arm_shapes import ARM_SHAPES, BASE, BEHIND_ELBOW
from slap_ros.motion.joints import Array
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, LAST_LINK, matrix
from slap_ros.worlds.panda import JOINTS, LINKS, link_poses

SURELY = 1.0 + 1e-9  # times a squared distance: no rounding comes near it


class MovingShapes(NamedTuple):
    """Boxes, each fixed to one of link 1 to link 7, with what is to be kept clear around them."""

    links: NDArray[np.intp]  # index of the link, 0 for link 1, shape (s,)
    frames: Array  # of the box in the link, lengths in m, shape (s, 4, 4)
    halves: Array  # half the box's edges, m, shape (s, 3)
    clearances: Array  # from the box to an obstacle, m, shape (s,)


class CollisionScene(NamedTuple):
    """Moving shapes among fixed boxes, the obstacles."""

    links: NDArray[np.intp]  # of the shapes, as those that follow: see MovingShapes
    frames: Array
    halves: Array
    clearances: Array
    turns: Array  # orientations of the obstacles, shape (o, 3, 3)
    sizes: Array  # half the obstacles' edges, m, shape (o, 3)
    origins: Array  # the base's origin seen from the obstacles, negated, m, shape (o, 3)
    reaches2: Array  # squared distance, m², from a shape's centre to a box it may touch: (s, o)
    middles: Array  # centres of the obstacles, m, shape (o, 3)
    far2: Array  # squared distance, m², from centre to centre, from which on that is ruled out

    def digest(self) -> bytes:
        """Equal for equal scenes."""
        digest = hashlib.blake2b(digest_size=16)
        for array in self:
            digest.update(str(array.shape).encode() + array.tobytes())
        return digest.digest()


def make_scene(
    shapes: MovingShapes, obstacles: Sequence[OrientedBox], base: bool
) -> CollisionScene:
    """The shapes among obstacles.

    Args:
        shapes: Shapes of the arm, and of what it holds, in the order of the links.
        obstacles: Boxes to keep clear of, in the base's frame.
        base: Whether the arm's base is in the way of forearm, hand and held box.
    """
    boxes = _obstacle_boxes((*obstacles, BASE) if base else tuple(obstacles))
    reaches = np.sqrt(dot(shapes.halves, shapes.halves)) + shapes.clearances
    reaches2 = np.repeat(reaches[:, None] ** 2, len(boxes.sizes), axis=1)
    if base:
        reaches2[:BEHIND_ELBOW, -1] = 0.0  # never tested: these are fixed to it
    far2 = (np.sqrt(reaches2) + boxes.radii) ** 2 * SURELY
    placed = boxes.turns, boxes.sizes, boxes.origins
    return CollisionScene(*shapes, *placed, reaches2, boxes.middles, far2)


class _ObstacleBoxes(NamedTuple):
    """Fixed boxes, as :class:`CollisionScene` has them."""

    turns: Array
    sizes: Array
    origins: Array
    middles: Array
    radii: Array  # half their diagonals, m, shape (o,)


@lru_cache(maxsize=256)  # as those that follow
def _obstacle_boxes(boxes: tuple[OrientedBox, ...]) -> _ObstacleBoxes:
    """The arrays of obstacles: several checkers of a state have the same."""
    poses = np.array([_frame(box.pose) for box in boxes]).reshape(-1, 4, 4)
    turns = np.ascontiguousarray(poses[:, :3, :3])
    sizes = np.array([box.half for box in boxes]).reshape(-1, 3)
    origins = dot(turns.swapaxes(1, 2), poses[:, None, :3, 3])
    middles = np.ascontiguousarray(poses[:, :3, 3])
    return _ObstacleBoxes(turns, sizes, origins, middles, np.sqrt(dot(sizes, sizes)))


@lru_cache(maxsize=256)  # of many states; nobody changes the arrays
def moving_shapes(
    held: OrientedBox | None, finger: float, margin: float, held_margin: float
) -> MovingShapes:
    """The arm's shapes and the held box.

    Args:
        held: Box that the hand holds; its pose is in the frame of the grasp point.
        finger: Distance of each finger from the middle, m.
        margin: Distance that the links keep from the obstacles, m.
        held_margin: Distance that the held box keeps, m; below 0, how deep it may overlap.
    """
    links, frames = [link for link, _ in _arm_shapes(finger)], [f for _, f in _arm_shapes(finger)]
    halves = [shape.box.half for shape in ARM_SHAPES]
    clearances = [shape.radius + margin for shape in ARM_SHAPES]
    if held is not None:
        links.append(LAST_LINK - 1)
        frames.append(matrix(GRASP_IN_LAST_LINK.compose(held.pose)))
        halves.append(held.half)
        clearances.append(held_margin)
    return MovingShapes(
        np.array(links, dtype=np.intp),
        cast(Array, np.stack(frames)),
        np.array(halves),
        np.array(clearances),
    )


@lru_cache(maxsize=1024)
def _frame(pose: Pose) -> Array:
    """The matrix of a pose: most things stand where they stood before."""
    return matrix(pose)


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
