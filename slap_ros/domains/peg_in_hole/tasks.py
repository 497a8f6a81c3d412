# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: tasks, sampled, and goals by name. Lengths in m, unless a name says mm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Goal, Task
from slap_ros.domains.benchtop.features import place_features, thing_features
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.tasks import BENCH_LIMITS, BenchSettings, Range
from slap_ros.domains.peg_in_hole.model import HOLE, IN, PEG
from slap_ros.domains.peg_in_hole.scenery import HOLES, PEG_RADIUS, PEGS, seat, wall_top
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at

MM = 1e-3  # m
HAND = hand_at((0.46, 0.0, 0.24))
BESIDE = (0.0, 0.4)  # limits of where things are to either side of the arm
MOST_CLEARANCE_MM = 10.0  # in a wider hole a peg tilts until it is not in it any more

GOALS: Mapping[str, Goal] = {
    "training": goal((IN, "peg1", "hole1"), (IN, "peg2", "hole2")),
    "test1": goal((IN, "peg1", "hole2"), (IN, "peg2", "hole1")),
    "test2": goal((IN, "peg1", "hole2")),
}


@dataclass(frozen=True)
class PegTasks(BenchSettings):
    """Where pegs and plates are is sampled for each task, one of each on either side of the arm.

    Args:
        clearance: Difference between the width of a hole and the diameter of a peg, mm.
        peg_x: Range of the x of a peg's middle, m.
        peg_y: Range of a peg's distance from y = 0, to its side of the arm, m.
        peg_yaw: Range of a peg's yaw, rad.
        plate_x: Range of the x of the hole in a plate's face, m.
        plate_y: Range of that hole's distance from y = 0, to its side of the arm, m.
        plate_yaw: Range of a plate's yaw, rad.
        height: Range of the height of the holes, m.
    """

    limits: ClassVar = {
        "clearance": (1.0, MOST_CLEARANCE_MM),
        "peg_x": BENCH_LIMITS["x"],
        "peg_y": BESIDE,
        "peg_yaw": BENCH_LIMITS["yaw"],
        "plate_x": BENCH_LIMITS["x"],
        "plate_y": BESIDE,
        "plate_yaw": BENCH_LIMITS["yaw"],
        "height": (0.05, 0.3),
    }

    clearance: float = 5.0
    peg_x: Range = (0.465, 0.49)
    peg_y: Range = (0.09, 0.13)
    peg_yaw: Range = (-0.5, 0.5)
    plate_x: Range = (0.68, 0.71)
    plate_y: Range = (0.1, 0.14)
    plate_yaw: Range = (-0.2, 0.2)
    height: Range = (0.12, 0.16)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with the training goal. The first hole is on the left; pegs are either way."""

        def draw(*ranges: Range) -> list[float]:
            return [float(rng.uniform(*interval)) for interval in ranges]

        features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HAND)}
        for name, side in zip(PEGS, rng.permutation([1.0, -1.0]).tolist(), strict=True):
            x, y, yaw = draw(self.peg_x, self.peg_y, self.peg_yaw)
            pose = Pose((x, side * y, PEG_RADIUS), from_yaw(yaw))
            features[PEG(name)] = thing_features(pose, PEG_RADIUS, PEG_RADIUS)
        top = wall_top(self.clearance * MM)
        for name, side in zip(HOLES, (1.0, -1.0), strict=True):
            x, y, z, yaw = draw(self.plate_x, self.plate_y, self.height, self.plate_yaw)
            features[HOLE(name)] = place_features(seat((x, side * y, z), yaw), top)
        state = State.build(features)
        return Task(state, GOALS["training"](state), STEP_LIMIT)
