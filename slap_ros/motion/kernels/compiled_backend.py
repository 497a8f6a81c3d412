# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion by compiled code."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slap_ros.compilation import compile_once
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.motion.collision_scene import CollisionScene, make_scene, moving_shapes
from slap_ros.motion.joints import RESOLUTION, Array, Joints, Path
from slap_ros.motion.kernels.free_space import CompiledFreeSpace
from slap_ros.motion.kernels.kinematics import arm_frames
from slap_ros.motion.kernels.linear import rows_to
from slap_ros.motion.kinematics import matrix
from slap_ros.motion.linear import rotation_vector
from slap_ros.worlds.panda import FINGER_OPEN, HOME, grasp_pose


class CompiledBackend:
    """See :class:`slap_ros.motion.backend.Backend`."""

    def arm_frames(self, q: Joints) -> Array:
        """See :meth:`slap_ros.motion.backend.Backend.arm_frames`."""
        return arm_frames(np.array(q, dtype=np.float64, order="C"))

    def free_space(self, scene: CollisionScene) -> CompiledFreeSpace:
        """See :meth:`slap_ros.motion.backend.Backend.free_space`."""
        return CompiledFreeSpace(scene)

    def linear_rows(self, q: Joints, start: Pose, target: Pose, count: int) -> Path | None:
        """See :meth:`slap_ros.motion.backend.Backend.linear_rows`."""
        shift = np.subtract(target.position, start.position)
        turn = np.array(rotation_vector(start, target))
        path = rows_to(np.array(q), matrix(start), shift, turn, count)
        return path if len(path) else None

    def calls(self) -> list[Callable[[], object]]:
        """A call of every compiled function, of which each takes about as long to compile."""
        start, rng = np.array(HOME), np.random.default_rng(0)
        goal = start + 0.1
        path = np.stack([start, goal])
        box = OrientedBox(Pose((0.5, 0.5, 0.5)), (0.1, 0.1, 0.1))
        scene = make_scene(moving_shapes(None, FINGER_OPEN, 0.0, 0.0), [box], True)
        space = self.free_space(scene)
        return [
            lambda: self.arm_frames(start[None]),
            lambda: self.linear_rows(start, grasp_pose(start), grasp_pose(goal), 1),
            lambda: space.nearest_configurations(np.eye(4)[None], start),
            lambda: space.free(start[None]),
            lambda: space.line_is_free(start, goal, RESOLUTION),
            lambda: space.path_is_free(path, RESOLUTION),
            lambda: space.via_point_path(start, goal, rng, RESOLUTION),
            lambda: space.rrt_connect(start, goal, rng, 1, RESOLUTION),
            lambda: space.shorten(path, rng, 1, RESOLUTION),
            lambda: space.straighten(path, RESOLUTION),
        ]


def compiled_backend() -> CompiledBackend:
    """Motion by compiled code, which is compiled now where that was not done yet."""
    backend = CompiledBackend()
    compile_once(backend.calls())
    return backend
