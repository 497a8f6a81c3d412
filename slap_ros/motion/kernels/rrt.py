# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two trees that grow towards each other, as :mod:`slap_ros.motion.rrt`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import HIGH, LOW, Array, Joints, Path
from slap_ros.motion.kernels.lines import (
    control_steps,
    free_row_count,
    place_on_line,
    row_count,
)
from slap_ros.motion.rrt import LEAST_GROWTH, MAX_GROWTH, WIDENING
from slap_ros.worlds.panda import JOINTS


class TreeArrays(NamedTuple):
    """Configurations, each with the row of its parent; row 0 is the root."""

    q: Joints  # rad, shape (capacity, 7)
    parents: NDArray[np.intp]  # shape (capacity,)
    size: NDArray[np.intp]  # shape (1,)


@compiled
def connect(
    start: Joints, goal: Joints, scene: CollisionScene, draws: Array, resolution: float
) -> tuple[Path, int]:
    """A collision-free path, as found, and how many samples it took.

    Args:
        start: Free configuration to start from, rad, shape (7,).
        goal: Free configuration to reach, rad, shape (7,).
        scene: Shapes of the arm and the obstacles.
        draws: Random numbers from 0 to 1, a row per sample: shape (samples, 7).
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (k, 7), and the number of samples; k is 0 if they are used up.
    """
    ahead, back = _planted(start, len(draws)), _planted(goal, len(draws))
    growing, other = ahead, back
    sample = np.empty(JOINTS)
    for i in range(len(draws)):
        _place_sample(start, goal, min(1.0, (i + 1) / WIDENING), draws[i], sample)
        _limit(growing, sample)
        if _grow(growing, sample, scene, resolution):
            meeting = growing.q[growing.size[0] - 1]
            met = _grow(other, meeting, scene, resolution)
            if met and control_steps(other.q[other.size[0] - 1], meeting) == 0.0:
                return _joined(ahead, back), i + 1
        growing, other = other, growing
    return np.empty((0, JOINTS)), len(draws)


@inner
def _planted(root: Joints, samples: int) -> TreeArrays:
    tree = TreeArrays(
        np.empty((samples + 1, JOINTS)), np.zeros(samples + 1, np.intp), np.ones(1, np.intp)
    )
    tree.q[0] = root
    return tree


@inner
def _place_sample(start: Joints, goal: Joints, widened: float, draws: Array, q: Joints) -> None:
    """A sample of the box around start and goal, widened towards the joint limits."""
    for joint in range(JOINTS):
        low, high = min(start[joint], goal[joint]), max(start[joint], goal[joint])
        low = low + widened * (LOW[joint] - low)
        high = high + widened * (HIGH[joint] - high)
        q[joint] = low + (high - low) * draws[joint]


@inner
def _nearest(tree: TreeArrays, q: Joints) -> int:
    row, least = 0, np.inf
    for i in range(tree.size[0]):
        steps = control_steps(tree.q[i], q)
        if steps < least:
            row, least = i, steps
    return row


@inner
def _limit(tree: TreeArrays, sample: Joints) -> None:
    """Move a sample to where it is no farther than the tree may grow."""
    nearest = tree.q[_nearest(tree, sample)]
    fraction = min(1.0, MAX_GROWTH / control_steps(nearest, sample))
    for joint in range(JOINTS):
        sample[joint] = nearest[joint] + fraction * (sample[joint] - nearest[joint])


@inner
def _grow(tree: TreeArrays, target: Joints, scene: CollisionScene, resolution: float) -> bool:
    """Add a configuration as far as the straight way is free; whether one was added."""
    parent = _nearest(tree, target)
    begin, newest = tree.q[parent], tree.q[tree.size[0]]
    count = row_count(begin, target, resolution)
    free = free_row_count(begin, target, scene, resolution)
    if free == 0:
        return False
    place_on_line(begin, target, free - 1, count, newest)
    if free < count and control_steps(begin, newest) < LEAST_GROWTH:
        return False
    tree.parents[tree.size[0]] = parent
    tree.size[0] += 1
    return True


@inner
def _depth(tree: TreeArrays) -> int:
    """How many rows lead from the newest one back to the root, both among them."""
    row, depth = tree.size[0] - 1, 1
    while row > 0:
        row, depth = tree.parents[row], depth + 1
    return depth


@inner
def _joined(ahead: TreeArrays, back: TreeArrays) -> Path:
    """From the root of one tree to that of the other, over what was added last to both."""
    depth = _depth(ahead)
    path = np.empty((depth + _depth(back) - 1, JOINTS))
    row = ahead.size[0] - 1
    for i in range(depth):
        path[depth - 1 - i] = ahead.q[row]
        row = ahead.parents[row]
    row = back.size[0] - 1
    for i in range(depth, len(path)):
        row = back.parents[row]
        path[i] = back.q[row]
    return path
