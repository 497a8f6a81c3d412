# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stow Hammer: tasks, sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.benchtop.cabinet import CABINET, cabinet_features
from slap_ros.domains.benchtop.features import thing_features
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.tasks import BenchSettings, Range
from slap_ros.domains.stow_hammer.model import GOALS
from slap_ros.domains.stow_hammer.scenery import HALF_LENGTH, HAMMER, HEAD_HALF, RADIUS
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at

HAND = hand_at((0.45, 0.0, 0.25), 0.5 * math.pi)
FACING = 0.5 * math.pi  # yaw of a front that faces the arm, and of a hammer that lies along it
TRIES = 1_000  # arrangements drawn before there is said to be no room
HAMMER_HALF = (HALF_LENGTH, HEAD_HALF[1], RADIUS)  # of the box around a hammer
# Of the box around the open fingers over its middle, which come down up to 25 mm aside.
HAND_HALF = (0.04, 0.095, 0.1)


@dataclass(frozen=True)
class StowTasks(BenchSettings):
    """A cabinet to either side, and between them two hammers, one behind the other.

    Args:
        hammer_x: Range of the x of hammers, m.
        hammer_y: Range of the y of hammers, m.
        hammer_turn: Range of the hammers' turn from lying along the fronts, rad.
        front_x: Range of the x of the middle of a cabinet's front, m.
        front_y: Range of that middle's distance from y = 0, to either side, m.
        front_turn: Range of a front's turn from facing the arm, rad.
    """

    limits: ClassVar = {
        "hammer_x": (0.41, 0.75),
        "hammer_y": (-0.1, 0.1),
        "hammer_turn": (-1.0, 1.0),
        "front_x": (0.42, 0.55),
        "front_y": (0.33, 0.4),
        "front_turn": (-0.3, 0.3),
    }

    hammer_x: Range = (0.44, 0.66)
    hammer_y: Range = (-0.05, 0.05)
    hammer_turn: Range = (-0.6, 0.6)
    front_x: Range = (0.45, 0.49)
    front_y: Range = (0.34, 0.37)
    front_turn: Range = (-0.15, 0.15)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with the training goal; either hammer may be the nearer one.

        Raises:
            InvalidParameterError: There is no room for two hammers.
        """
        features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HAND)}
        for number, lying in enumerate(self._hammers(rng)):
            features[HAMMER(f"hammer{number}")] = thing_features(lying, RADIUS, RADIUS)
        for number, side in enumerate((1.0, -1.0)):
            x, y, turn = (
                float(rng.uniform(*interval))
                for interval in (self.front_x, self.front_y, self.front_turn)
            )
            front = Pose((x, side * y, 0.0), from_yaw(FACING + turn))
            features[CABINET(f"cabinet{number}")] = cabinet_features(front)
        state = State.build(features)
        return Task(state, GOALS["training"](state), STEP_LIMIT)

    def _hammers(self, rng: np.random.Generator) -> tuple[Pose, Pose]:
        """Where both lie; there is room for a hand around each."""
        for _ in range(TRIES):
            first, second = self._hammer(rng), self._hammer(rng)
            if _leaves_room(first, second) and _leaves_room(second, first):
                return first, second
        raise InvalidParameterError(
            f"there is no room for two hammers at x from {self.hammer_x[0]} to {self.hammer_x[1]} m"
        )

    def _hammer(self, rng: np.random.Generator) -> Pose:
        x, y, turn = (
            float(rng.uniform(*interval))
            for interval in (self.hammer_x, self.hammer_y, self.hammer_turn)
        )
        return Pose((x, y, RADIUS), from_yaw(FACING + turn))


def _leaves_room(one: Pose, other: Pose) -> bool:
    """Whether the hand that takes one hammer does not touch the other."""
    lying = OrientedBox(other, HAMMER_HALF)
    return not any(OrientedBox(one, half).overlaps(lying) for half in (HAMMER_HALF, HAND_HALF))
