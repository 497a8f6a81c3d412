# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make Coffee: tasks, sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.benchtop.cabinet import CABINET, MIDDLE, cabinet_features
from slap_ros.domains.benchtop.features import jointed_features, thing_features
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.tasks import BenchSettings, Range
from slap_ros.domains.make_coffee.model import GOALS
from slap_ros.domains.make_coffee.scenery import BOTTOM, HOLDER, LID_HIGH, POD, POD_HALF
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at

FACING = 0.5 * math.pi  # yaw of a front that faces the arm
HAND = hand_at((0.45, 0.0, 0.25), 0.25 * math.pi)


@dataclass(frozen=True)
class CoffeeTasks(BenchSettings):
    """The cabinet is on the left, the holder on the right. Each setting is a range to sample from.

    Args:
        front_x: X of the middle of the cabinet's front, m.
        front_y: Y of the middle of the cabinet's front, m.
        front_turn: Turn of the cabinet's front from facing the arm, rad.
        pod_aside: Distance of the pod from the middle of the drawer along the front, m.
        pod_deep: Distance of the pod from the middle of the drawer in the direction in which it
            opens, m.
        holder_x: X of the holder, m.
        holder_y: Y of the holder, m.
        holder_turn: Turn of the holder from the yaw at which its lid opens away from the arm, rad.
        lid: How far the lid is open, rad.
    """

    limits: ClassVar = {
        "front_x": (0.45, 0.55),
        "front_y": (0.3, 0.4),
        "front_turn": (-0.3, 0.3),
        "pod_aside": (-0.025, 0.025),
        "pod_deep": (-0.02, 0.02),
        "holder_x": (0.47, 0.55),
        "holder_y": (-0.25, -0.1),
        "holder_turn": (-0.3, 0.3),
        "lid": (1.6, LID_HIGH),
    }

    front_x: Range = (0.48, 0.52)
    front_y: Range = (0.32, 0.35)
    front_turn: Range = (-0.15, 0.15)
    pod_aside: Range = (-0.02, 0.02)
    pod_deep: Range = (-0.015, 0.015)
    holder_x: Range = (0.49, 0.53)
    holder_y: Range = (-0.19, -0.15)
    holder_turn: Range = (-0.15, 0.15)
    lid: Range = (1.9, 2.05)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with the training goal."""

        def draw(*intervals: Range) -> list[float]:
            return [float(rng.uniform(*interval)) for interval in intervals]

        x, y, turn = draw(self.front_x, self.front_y, self.front_turn)
        front = Pose((x, y, 0.0), from_yaw(FACING + turn))
        aside, deep = draw(self.pod_aside, self.pod_deep)
        _, middle, floor = MIDDLE
        standing = front.compose(Pose((aside, middle + deep, floor + POD_HALF)))
        x, y, turn, opening = draw(self.holder_x, self.holder_y, self.holder_turn, self.lid)
        frame = Pose((x, y, 0.0), from_yaw(turn))
        features: dict[Object, Mapping[str, float]] = {
            ROBOT("robot"): robot_features(HAND),
            POD("pod"): thing_features(standing, POD_HALF, POD_HALF),
            CABINET("cabinet"): cabinet_features(front),
            HOLDER("holder"): jointed_features(frame, opening, BOTTOM),
        }
        state = State.build(features)
        return Task(state, GOALS["training"](state), STEP_LIMIT)
