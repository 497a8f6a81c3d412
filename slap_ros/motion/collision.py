# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the arm, and what it holds, is clear of boxes: for many configurations at once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from slap_ros.geometry.box_separation import Flags
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.motion.backend import backend
from slap_ros.motion.collision_scene import make_scene, moving_shapes
from slap_ros.motion.joints import Joints
from slap_ros.worlds.panda import FINGER_OPEN, JOINTS

MARGIN = 0.005  # m, that the arm keeps from everything
HELD_MARGIN = -0.001  # m: a held box may rest on what it is lifted from or set down on


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
        self.scene = make_scene(moving_shapes(held, finger, margin, held_margin), obstacles, base)
        self.space = backend().free_space(self.scene)

    @cached_property
    def key(self) -> bytes:
        """Equal for checkers of equal scenes."""
        return self.scene.digest()

    def __call__(self, q: Joints) -> Flags:
        """Whether the configurations are free: shape (..., 7) to (...)."""
        free = self.space.free(np.asarray(q, dtype=np.float64).reshape(-1, JOINTS))
        return free.reshape(np.shape(q)[:-1])
