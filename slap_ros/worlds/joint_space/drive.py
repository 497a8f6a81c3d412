# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a link moves through a control period: it pushes with the velocity that takes it there."""

from __future__ import annotations

import math
from typing import NamedTuple

from slap_ros.geometry.pose import Pose, Vector, conjugate, multiply
from slap_ros.worlds.panda import CONTROL_PERIOD_S

LEAST_SINE = 1e-12  # of half an angle, below which nothing turns


class Drive(NamedTuple):
    """A driven body's way through a control period."""

    start: Pose
    velocity: Vector  # m/s
    angular_velocity: Vector  # rad/s

    @classmethod
    def between(cls, start: Pose, end: Pose) -> Drive:
        """The drive from one pose to another at constant velocity, the shorter way round."""
        (ax, ay, az), (bx, by, bz) = start.position, end.position
        t = CONTROL_PERIOD_S
        x, y, z, w = multiply(end.quaternion, conjugate(start.quaternion))
        sine = math.sqrt(x * x + y * y + z * z)
        rate = 0.0 if sine < LEAST_SINE else 2.0 * math.atan2(sine, abs(w)) / sine / t
        rate = math.copysign(rate, w)
        return cls(
            start, ((bx - ax) / t, (by - ay) / t, (bz - az) / t), (x * rate, y * rate, z * rate)
        )
