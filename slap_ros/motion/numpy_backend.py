# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion in numpy alone: where numba is missing, and to compare compiled code with."""

from __future__ import annotations

from functools import partial

from slap_ros.geometry.pose import Pose
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.free_space import NumpyFreeSpace
from slap_ros.motion.joints import Array, Joints, Path
from slap_ros.motion.linear import linear_rows
from slap_ros.motion.numpy_collision import free_flags
from slap_ros.motion.numpy_kinematics import arm_frames


class NumpyBackend:
    """See :class:`slap_ros.motion.backend.Backend`."""

    def arm_frames(self, q: Joints) -> Array:
        """See :meth:`slap_ros.motion.backend.Backend.arm_frames`."""
        return arm_frames(q)

    def free_space(self, scene: CollisionScene) -> NumpyFreeSpace:
        """See :meth:`slap_ros.motion.backend.Backend.free_space`."""
        return NumpyFreeSpace(partial(free_flags, scene))

    def linear_rows(self, q: Joints, start: Pose, target: Pose, count: int) -> Path | None:
        """See :meth:`slap_ros.motion.backend.Backend.linear_rows`."""
        return linear_rows(q, start, target, count)
