# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The free space of a scene, by compiled code."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slap_ros.geometry.box_separation import Flags
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Array, Joints, Path
from slap_ros.motion.kernels import lines, shortcutting
from slap_ros.motion.kernels.collision import free_flags
from slap_ros.motion.kernels.inverse_kinematics import nearest
from slap_ros.motion.kernels.random_draws import with_draws
from slap_ros.motion.kernels.rrt import connect
from slap_ros.motion.kernels.via_point import first_free_via_point
from slap_ros.motion.numpy_inverse_kinematics import sweep
from slap_ros.motion.via_point import draw_via_points


@dataclass(frozen=True, eq=False)
class CompiledFreeSpace:
    """See :class:`slap_ros.motion.free_space.FreeSpace`; numpy finds the same to the bit."""

    scene: CollisionScene

    def free(self, q: Joints) -> Flags:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.free`."""
        return free_flags(self.scene, _plain(q))

    def line_is_free(self, start: Joints, goal: Joints, resolution: float) -> bool:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.line_is_free`."""
        return lines.line_is_free(_plain(start), _plain(goal), self.scene, resolution)

    def path_is_free(self, path: Path, resolution: float) -> bool:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.path_is_free`."""
        return lines.path_is_free(_plain(path), self.scene, resolution)

    def nearest_configurations(self, targets: Array, near: Joints) -> Joints:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.nearest_configurations`."""
        return nearest(_plain(targets), sweep(near), _plain(near), self.scene)

    def via_point_path(
        self, start: Joints, goal: Joints, rng: np.random.Generator, resolution: float
    ) -> Path | None:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.via_point_path`."""
        via_points = draw_via_points(start, goal, rng)
        ends = _plain(start), _plain(goal)
        row = first_free_via_point(ends[0], _plain(via_points), ends[1], self.scene, resolution)
        return None if row < 0 else np.stack([start, via_points[row], goal])

    def rrt_connect(
        self,
        start: Joints,
        goal: Joints,
        rng: np.random.Generator,
        max_samples: int,
        resolution: float,
    ) -> Path | None:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.rrt_connect`."""

        def search(draws: Array) -> tuple[Path, int]:
            return connect(_plain(start), _plain(goal), self.scene, draws, resolution)

        path = with_draws(rng, (max_samples, len(start)), search)
        return path if len(path) else None

    def shorten(self, path: Path, rng: np.random.Generator, tries: int, resolution: float) -> Path:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.shorten`."""

        def cut(draws: Array) -> tuple[Path, int]:
            return shortcutting.shorten(_plain(path), self.scene, draws, resolution)

        return with_draws(rng, (tries, 2), cut)

    def straighten(self, path: Path, resolution: float) -> Path:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.straighten`."""
        return shortcutting.straighten(_plain(path), self.scene, resolution)


def _plain(array: Array) -> Array:
    """The array in the one layout that the code is compiled for: numba compiles for each."""
    if array.flags.c_contiguous and array.flags.writeable:
        return array
    return np.array(array, order="C")
