# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The first via point with a free path, as :mod:`slap_ros.motion.via_point`."""

from __future__ import annotations

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import Joints
from slap_ros.motion.kernels.collision import is_free
from slap_ros.motion.kernels.lines import is_line_free
from slap_ros.motion.via_point import COARSE_CHECKS
from slap_ros.worlds.panda import JOINTS


@compiled
def first_free_via_point(
    start: Joints, via_points: Joints, goal: Joints, scene: CollisionScene, resolution: float
) -> int:
    """The row of the first via point over which the path is free; -1 if none is.

    Args:
        start: Configuration to start from, rad, shape (7,).
        via_points: Configurations to go over, rad, shape (k, 7).
        goal: Configuration to reach, rad, shape (7,).
        scene: Shapes of the arm and the obstacles.
        resolution: Control steps between checked configurations.
    """
    if not is_free(start, scene):
        return -1
    for row in range(len(via_points)):
        via_point = via_points[row]
        if (
            _looks_free(start, via_point, goal, scene)
            and is_line_free(start, via_point, scene, resolution)
            and is_line_free(via_point, goal, scene, resolution)
        ):
            return row
    return -1


@inner
def _looks_free(start: Joints, via_point: Joints, goal: Joints, scene: CollisionScene) -> bool:
    """Whether a few configurations each way are free: they reveal most blocked paths."""
    q = np.empty(JOINTS)
    for count in COARSE_CHECKS:
        for i in range(1, count + 1):
            _place_on_way(start, via_point, i / count, q)
            if not is_free(q, scene):
                return False
            _place_on_way(goal, via_point, i / count, q)
            if i < count and not is_free(q, scene):
                return False
    return True


@inner
def _place_on_way(end: Joints, via_point: Joints, fraction: float, q: Joints) -> None:
    for joint in range(JOINTS):
        q[joint] = end[joint] + fraction * (via_point[joint] - end[joint])
