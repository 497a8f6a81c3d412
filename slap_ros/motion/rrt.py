# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bidirectional RRT: two trees that grow towards each other from start and goal.

J. Kuffner, S. LaValle: RRT-Connect: An Efficient Approach to Single-Query Path Planning, ICRA 2000.
Unlike there, a tree grows towards a sample by one straight piece, not by small steps. Distances are
control steps. Samples come from a box around start and goal that widens to the joint limits, so
that near ways are found first.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from slap_ros.motion.joints import (
    HIGH,
    LOW,
    Free,
    Joints,
    Path,
    control_steps,
    free_count,
    interpolate,
)

MAX_GROWTH = 15.0  # control steps that a tree grows at most towards a sample
WIDENING = 50  # samples until the sampled box has reached the joint limits
LEAST_GROWTH = 0.5  # control steps; less is no progress


class _Tree:
    """Configurations, each with the row of its parent; row 0 is the root."""

    def __init__(self, root: Joints) -> None:
        self._q = np.tile(root, (64, 1))
        self._parents = [0]

    def nearest(self, q: Joints) -> int:
        return int(np.argmin(control_steps(q, self._q[: len(self._parents)])))

    def add(self, q: Joints, parent: int) -> None:
        if len(self._parents) == len(self._q):
            self._q = np.concatenate([self._q, self._q])
        self._q[len(self._parents)] = q
        self._parents.append(parent)

    def __getitem__(self, row: int) -> Joints:
        return cast(Joints, self._q[row])

    def newest(self) -> Joints:
        return self[len(self._parents) - 1]

    def branch(self) -> list[Joints]:
        """From the newest configuration back to the root."""
        row, branch = len(self._parents) - 1, []
        while row:
            branch.append(self[row])
            row = self._parents[row]
        return [*branch, self[0]]

    def grow(self, target: Joints, free: Free, resolution: float) -> bool:
        """Add a configuration as far as the straight way to the target is free.

        Returns:
            Whether one was added.
        """
        parent = self.nearest(target)
        line = interpolate(self[parent], target, resolution)
        count = free_count(line, free)
        if count == 0 or (
            count < len(line) and control_steps(self[parent], line[count - 1]) < LEAST_GROWTH
        ):
            return False
        self.add(line[count - 1], parent)
        return True


def rrt_connect(
    start: Joints,
    goal: Joints,
    free: Free,
    rng: np.random.Generator,
    *,
    max_samples: int,
    resolution: float,
) -> Path | None:
    """A collision-free path, as found: neither short nor smooth.

    Args:
        start: Free configuration to start from, rad, shape (7,).
        goal: Free configuration to reach, rad, shape (7,).
        free: Checker of which configurations are free of collisions.
        rng: Source of random numbers for the samples.
        max_samples: Number of samples after which the search gives up.
        resolution: Control steps between checked configurations.

    Returns:
        rad, shape (k, 7); None if the samples are used up.
    """
    low, high = np.minimum(start, goal), np.maximum(start, goal)
    forward = True
    trees = _Tree(start), _Tree(goal)
    for i in range(max_samples):
        widened = min(1.0, (i + 1) / WIDENING)
        sample = rng.uniform(low + widened * (LOW - low), high + widened * (HIGH - high))
        growing, other = trees if forward else trees[::-1]
        forward = not forward
        if not growing.grow(_limited(growing, sample), free, resolution):
            continue
        meeting = growing.newest()
        if other.grow(meeting, free, resolution) and np.array_equal(other.newest(), meeting):
            first, second = trees[0].branch()[::-1], trees[1].branch()[1:]
            path: Path = np.stack([*first, *second])
            return path
    return None


def _limited(tree: _Tree, sample: Joints) -> Joints:
    """The sample, or a configuration on the way to it that is as far as the tree may grow."""
    nearest = tree[tree.nearest(sample)]
    fraction = min(1.0, MAX_GROWTH / float(control_steps(nearest, sample)))
    return nearest + fraction * (sample - nearest)
