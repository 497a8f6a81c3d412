# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes between a robot and its sensors: noise, loss, delay; a function of a seed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ensemble.robot_parameters import SimulatedRobotParameters
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose, multiply


class NoiseModel:
    """Draws noise, losses and delays."""

    def __init__(self, parameters: SimulatedRobotParameters) -> None:
        """Draw what a node's parameters ask for, from their seed.

        Raises:
            InvalidParameterError: Every detection is lost.
        """
        if parameters.dropout >= 1.0:
            raise InvalidParameterError(f"dropout is a share in [0, 1), not {parameters.dropout}")
        self._parameters = parameters
        self._rng = np.random.default_rng(parameters.noise_seed)

    def delay_s(self) -> float:
        """A delay, s."""
        return self._parameters.latency + self._parameters.jitter * float(self._rng.random())

    def dropped(self) -> bool:
        """Whether a detection is lost."""
        return bool(self._rng.random() < self._parameters.dropout)

    def joints(self, joints: Sequence[float]) -> list[float]:
        """Joint positions as encoders measure them, rad."""
        noise = self._parameters.joint_noise * self._rng.standard_normal(len(joints))
        return [float(q + n) for q, n in zip(joints, noise, strict=True)]

    def perturbed(self, pose: Pose) -> Pose:
        """A pose as a detector measures it."""
        dx, dy, dz = (self._parameters.pose_noise * self._rng.standard_normal(3)).tolist()
        a, b, c = (0.5 * self._parameters.turn_noise * self._rng.standard_normal(3)).tolist()
        length = math.sqrt(1.0 + a * a + b * b + c * c)
        turn = (a / length, b / length, c / length, 1.0 / length)
        x, y, z = pose.position
        return Pose((x + dx, y + dy, z + dz), multiply(turn, pose.quaternion))
