# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: tasks, sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.tasks import BENCH_LIMITS, BenchSettings, Range, spread_out
from slap_ros.domains.stack_at_target.model import CUBE, GOALS, TARGET
from slap_ros.domains.stack_at_target.scenery import TARGET_HALF, cube_features, target_features
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at

HAND = hand_at((0.5, 0.0, 0.25))
BLOCKER_OFF = 0.005  # from a target's middle, at most, along each axis


@dataclass(frozen=True)
class StackTasks(BenchSettings):
    """Where cubes and targets stand is sampled for each task.

    Args:
        cubes: Number of cubes on the table, besides those that block targets.
        blocked: Number of targets that are blocked, target0 first, each by one more cube. There is
            one more target than that.
        x: Range of the x of what stands on the table, m.
        y: Range of the y of what stands on the table, m.
        yaw: Range of the yaw of cubes, rad.
        apart: Least distance between the middles of what stands on the table, m.
    """

    limits: ClassVar = BENCH_LIMITS | {"cubes": (2, 4), "blocked": (0, 2), "apart": (0.0, 0.5)}

    cubes: int = 2
    blocked: int = 0
    x: Range = (0.43, 0.67)
    y: Range = (-0.22, 0.22)
    yaw: Range = (-math.pi / 4, math.pi / 4)
    apart: float = 0.135  # as far as a palm over one reaches the corner of another

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with the training goal.

        Raises:
            InvalidParameterError: There is no room for so many.
        """
        targets = 1 + self.blocked
        places = spread_out(rng, targets + self.cubes, self.x, self.y, self.apart)
        features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HAND)}
        for i, (x, y) in enumerate(places[:targets]):
            features[TARGET(f"target{i}")] = target_features(x, y)
        for i, (x, y) in enumerate(places[targets:]):
            features[CUBE(f"cube{i}")] = cube_features(x, y, float(rng.uniform(*self.yaw)))
        for i, (x, y) in enumerate(places[: self.blocked]):
            (dx, dy), top = rng.uniform(-BLOCKER_OFF, BLOCKER_OFF, 2).tolist(), 2.0 * TARGET_HALF[2]
            yaw = float(rng.uniform(*self.yaw))
            features[CUBE(f"cube{self.cubes + i}")] = cube_features(x + dx, y + dy, yaw, top)
        state = State.build(features)
        return Task(state, GOALS["training"](state), STEP_LIMIT)
