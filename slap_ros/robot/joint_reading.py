# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint positions of the arm, as measured."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.errors import InvalidMeasurementError
from slap_ros.worlds.panda import JOINTS

STANDS = 0.05  # rad/s, of each joint of an arm at rest


@dataclass(frozen=True)
class JointReading:
    """What the robot's encoders measure."""

    stamp_s: float  # when it was measured
    joints: tuple[float, ...]  # rad
    velocities: tuple[float, ...] = ()  # rad/s; empty: not measured
    gap: float | None = None  # m, between the fingers; None: not measured

    def __post_init__(self) -> None:
        """Refuse what cannot be a measurement.

        Raises:
            InvalidMeasurementError: Not seven joints, or not finite.
        """
        numbers = (*self.joints, *self.velocities, 0.0 if self.gap is None else self.gap)
        if len(self.joints) != JOINTS or not all(map(math.isfinite, numbers)):
            raise InvalidMeasurementError(f"joint positions {self.joints} are not {JOINTS} numbers")

    @property
    def at_rest(self) -> bool:
        """Whether the arm stands, as far as velocities are measured."""
        return all(abs(v) <= STANDS for v in self.velocities)
