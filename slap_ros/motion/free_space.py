# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The free configurations, and what planning asks of them: lines, paths, and ways around."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slap_ros.motion.collision import CollisionChecker
from slap_ros.motion.joints import (
    Array,
    Free,
    Joints,
    Path,
    free_count,
    interpolate,
    path_configurations,
)
from slap_ros.motion.numpy_inverse_kinematics import nearest_configurations
from slap_ros.motion.rrt import rrt_connect
from slap_ros.motion.shortcutting import shorten, straighten
from slap_ros.motion.via_point import via_point_path


class FreeSpace(Protocol):
    """Configurations without collisions."""

    @property
    def free(self) -> Free:
        """The checker of which configurations are free."""
        ...

    def line_is_free(self, start: Joints, goal: Joints, resolution: float) -> bool:
        """Whether the straight line is, its start left out.

        Args:
            start: Configuration to start from, rad, shape (7,).
            goal: Configuration to reach, rad, shape (7,).
            resolution: Control steps between checked configurations.
        """
        ...

    def path_is_free(self, path: Path, resolution: float) -> bool:
        """Whether a path is, all along; ``resolution``: control steps between what is checked."""
        ...

    def nearest_configurations(self, targets: Array, near: Joints) -> Joints:
        """See :func:`slap_ros.motion.numpy_inverse_kinematics.nearest_configurations`."""
        ...

    def via_point_path(
        self, start: Joints, goal: Joints, rng: np.random.Generator, resolution: float
    ) -> Path | None:
        """See :func:`slap_ros.motion.via_point.via_point_path`."""
        ...

    def rrt_connect(
        self,
        start: Joints,
        goal: Joints,
        rng: np.random.Generator,
        max_samples: int,
        resolution: float,
    ) -> Path | None:
        """See :func:`slap_ros.motion.rrt.rrt_connect`."""
        ...

    def shorten(self, path: Path, rng: np.random.Generator, tries: int, resolution: float) -> Path:
        """See :func:`slap_ros.motion.shortcutting.shorten`."""
        ...

    def straighten(self, path: Path, resolution: float) -> Path:
        """See :func:`slap_ros.motion.shortcutting.straighten`."""
        ...


def free_space(free: Free) -> FreeSpace:
    """The free space of a checker: that of its scene where it has one."""
    return free.space if isinstance(free, CollisionChecker) else NumpyFreeSpace(free)


@dataclass(frozen=True)
class NumpyFreeSpace:
    """The free space of any checker, whose configurations are checked in batches by numpy."""

    free: Free

    def line_is_free(self, start: Joints, goal: Joints, resolution: float) -> bool:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.line_is_free`."""
        line = interpolate(start, goal, resolution)
        return free_count(line, self.free) == len(line)

    def path_is_free(self, path: Path, resolution: float) -> bool:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.path_is_free`."""
        return bool(self.free(path_configurations(path, resolution)).all())

    def nearest_configurations(self, targets: Array, near: Joints) -> Joints:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.nearest_configurations`."""
        return nearest_configurations(targets, near, self.free)

    def via_point_path(
        self, start: Joints, goal: Joints, rng: np.random.Generator, resolution: float
    ) -> Path | None:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.via_point_path`."""
        return via_point_path(start, goal, self.free, rng, resolution=resolution)

    def rrt_connect(
        self,
        start: Joints,
        goal: Joints,
        rng: np.random.Generator,
        max_samples: int,
        resolution: float,
    ) -> Path | None:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.rrt_connect`."""
        return rrt_connect(
            start, goal, self.free, rng, max_samples=max_samples, resolution=resolution
        )

    def shorten(self, path: Path, rng: np.random.Generator, tries: int, resolution: float) -> Path:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.shorten`."""
        return shorten(path, self.free, rng, tries=tries, resolution=resolution)

    def straighten(self, path: Path, resolution: float) -> Path:
        """See :meth:`slap_ros.motion.free_space.FreeSpace.straighten`."""
        return straighten(path, self.free, resolution=resolution)
