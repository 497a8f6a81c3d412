# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes between a cell and its robot: noise, loss, delay; a function of a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose, multiply


@dataclass(frozen=True)
class NoiseSettings:
    """How bad it is; standard deviations along or about each axis."""

    latency_s: float = 0.0
    jitter_s: float = 0.0  # at most, on top of the latency
    position_m: float = 0.0
    turn_rad: float = 0.0
    joint_rad: float = 0.0
    dropout: float = 0.0  # share of detections lost

    def __post_init__(self) -> None:
        """Refuse what is no disturbance.

        Raises:
            InvalidParameterError: Negative, or everything lost.
        """
        values = (self.latency_s, self.jitter_s, self.position_m, self.turn_rad, self.joint_rad)
        if not all(math.isfinite(v) and v >= 0.0 for v in values):
            raise InvalidParameterError(f"latency, jitter and noise must not be negative: {self}")
        if not 0.0 <= self.dropout < 1.0:
            raise InvalidParameterError(f"dropout is a share in [0, 1), not {self.dropout}")


class NoiseModel:
    """Draws disturbances."""

    def __init__(self, disturbance: NoiseSettings, rng: np.random.Generator) -> None:
        self._by, self._rng = disturbance, rng

    def delay_s(self) -> float:
        """How late something is."""
        return self._by.latency_s + self._by.jitter_s * float(self._rng.random())

    def dropped(self) -> bool:
        """Whether a detection is lost."""
        return bool(self._rng.random() < self._by.dropout)

    def joints(self, joints: list[float]) -> list[float]:
        """Joint positions as encoders tell them, rad."""
        noise = self._by.joint_rad * self._rng.standard_normal(len(joints))
        return [float(q + n) for q, n in zip(joints, noise, strict=True)]

    def seen(self, pose: Pose) -> Pose:
        """A pose as a detector tells it."""
        dx, dy, dz = (self._by.position_m * self._rng.standard_normal(3)).tolist()
        a, b, c = (0.5 * self._by.turn_rad * self._rng.standard_normal(3)).tolist()
        length = math.sqrt(1.0 + a * a + b * b + c * c)
        turn = (a / length, b / length, c / length, 1.0 / length)
        x, y, z = pose.position
        return Pose((x + dx, y + dy, z + dz), multiply(turn, pose.quaternion))
