# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Straight lines and paths in the joint space, as :mod:`slap_ros.motion.joints`.

A line that is called free is checked at every one of its configurations. Only the order differs
from that of numpy, and one that is blocked is given up at once.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import STEP, STRIDE, Joints, Path
from slap_ros.motion.kernels.collision import is_free
from slap_ros.worlds.panda import JOINTS


@inner
def control_steps(start: Joints, goal: Joints) -> float:
    """Control steps from one configuration straight to another, not rounded."""
    most = 0.0
    for joint in range(JOINTS):
        most = max(most, abs(goal[joint] - start[joint]) / STEP[joint])
    return most


@inner
def row_count(start: Joints, goal: Joints, resolution: float) -> int:
    """How many configurations are on a line: 1 at least, the start left out.

    Args:
        start: Configuration where the line begins, rad, shape (7,).
        goal: Configuration where it ends, rad, shape (7,).
        resolution: Control steps between checked configurations.
    """
    return max(1, math.ceil(control_steps(start, goal) / resolution))


@inner
def place_on_line(start: Joints, goal: Joints, row: int, count: int, q: Joints) -> None:
    """Write one configuration of a line; the last is exactly the goal.

    Args:
        start: Configuration where the line begins, rad, shape (7,).
        goal: Configuration where it ends, rad, shape (7,).
        row: Row of the line, from 0.
        count: Number of rows.
        q: Where it is written, rad, shape (7,).
    """
    fraction = (row + 1) / count
    for joint in range(JOINTS):
        on_line = start[joint] + fraction * (goal[joint] - start[joint])
        q[joint] = goal[joint] if row + 1 == count else on_line


@inner
def is_line_free(start: Joints, goal: Joints, scene: CollisionScene, resolution: float) -> bool:
    """Whether a line is free, its start left out: rows far from each other come first.

    Args:
        start: Configuration where the line begins, rad, shape (7,).
        goal: Configuration where it ends, rad, shape (7,).
        scene: Shapes of the arm and the obstacles.
        resolution: Control steps between checked configurations.
    """
    count, q = row_count(start, goal, resolution), np.empty(JOINTS)
    for begin in range(STRIDE):
        for row in range(count - 1 - begin, -1, -STRIDE):
            place_on_line(start, goal, row, count, q)
            if not is_free(q, scene):
                return False
    return True


@inner
def is_path_free(path: Path, scene: CollisionScene, resolution: float) -> bool:
    """Whether a path is free, all along.

    Args:
        path: Configurations of the path, rad, shape (k, 7).
        scene: Shapes of the arm and the obstacles.
        resolution: Control steps between checked configurations.
    """
    free, row = is_free(path[0], scene), 1
    while free and row < len(path):
        free = is_line_free(path[row - 1], path[row], scene, resolution)
        row += 1
    return free


@inner
def free_row_count(start: Joints, goal: Joints, scene: CollisionScene, resolution: float) -> int:
    """How many rows of a line come before the first that is not free.

    Args:
        start: Configuration where the line begins, rad, shape (7,).
        goal: Configuration where it ends, rad, shape (7,).
        scene: Shapes of the arm and the obstacles.
        resolution: Control steps between checked configurations.
    """
    count, q = row_count(start, goal, resolution), np.empty(JOINTS)
    blocked = count
    for row in range((count - 1) % STRIDE, count, STRIDE):
        place_on_line(start, goal, row, count, q)
        if not is_free(q, scene):
            blocked = row
            break
    for row in range(blocked):
        if row % STRIDE != (count - 1) % STRIDE:
            place_on_line(start, goal, row, count, q)
            if not is_free(q, scene):
                return row
    return blocked


@compiled
def line_is_free(start: Joints, goal: Joints, scene: CollisionScene, resolution: float) -> bool:
    """See :meth:`slap_ros.motion.free_space.FreeSpace.line_is_free`."""
    return is_line_free(start, goal, scene, resolution)


@compiled
def path_is_free(path: Path, scene: CollisionScene, resolution: float) -> bool:
    """See :meth:`slap_ros.motion.free_space.FreeSpace.path_is_free`."""
    return is_path_free(path, scene, resolution)
