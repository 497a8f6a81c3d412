# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes between a robot and its sensors: noise, loss, delay; a function of a seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ensemble.robot_parameters import SimulatedRobotParameters
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose, multiply


@dataclass(frozen=True)
class NoiseSettings:
    """How large it is; standard deviations along or about each axis."""

    latency_s: float = 0.0
    jitter_s: float = 0.0  # at most, on top of the latency
    position_m: float = 0.0
    turn_rad: float = 0.0
    joint_rad: float = 0.0
    dropout: float = 0.0  # share of detections lost

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            InvalidParameterError: Negative, or everything lost.
        """
        values = (self.latency_s, self.jitter_s, self.position_m, self.turn_rad, self.joint_rad)
        if not all(math.isfinite(v) and v >= 0.0 for v in values):
            raise InvalidParameterError(f"latency, jitter and noise must not be negative: {self}")
        if not 0.0 <= self.dropout < 1.0:
            raise InvalidParameterError(f"dropout is a share in [0, 1), not {self.dropout}")


class NoiseModel:
    """Draws noise, losses and delays."""

    def __init__(self, settings: NoiseSettings, rng: np.random.Generator) -> None:
        self._settings, self._rng = settings, rng

    @classmethod
    def of(cls, parameters: SimulatedRobotParameters) -> NoiseModel:
        """The noise that a node's parameters ask for.

        Raises:
            InvalidParameterError: Negative, or everything lost.
        """
        settings = NoiseSettings(
            parameters.latency,
            parameters.jitter,
            parameters.pose_noise,
            parameters.turn_noise,
            parameters.joint_noise,
            parameters.dropout,
        )
        return cls(settings, np.random.default_rng(parameters.noise_seed))

    def delay_s(self) -> float:
        """A delay, s."""
        return self._settings.latency_s + self._settings.jitter_s * float(self._rng.random())

    def dropped(self) -> bool:
        """Whether a detection is lost."""
        return bool(self._rng.random() < self._settings.dropout)

    def joints(self, joints: Sequence[float]) -> list[float]:
        """Joint positions as encoders measure them, rad."""
        noise = self._settings.joint_rad * self._rng.standard_normal(len(joints))
        return [float(q + n) for q, n in zip(joints, noise, strict=True)]

    def perturbed(self, pose: Pose) -> Pose:
        """A pose as a detector measures it."""
        dx, dy, dz = (self._settings.position_m * self._rng.standard_normal(3)).tolist()
        a, b, c = (0.5 * self._settings.turn_rad * self._rng.standard_normal(3)).tolist()
        length = math.sqrt(1.0 + a * a + b * b + c * c)
        turn = (a / length, b / length, c / length, 1.0 / length)
        x, y, z = pose.position
        return Pose((x + dx, y + dy, z + dz), multiply(turn, pose.quaternion))
