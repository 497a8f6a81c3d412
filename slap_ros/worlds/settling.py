# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of bodies at rest, turned so that they lie flat."""

from __future__ import annotations

import math

from slap_ros.geometry.pose import Pose, Vector, multiply, normalised, rotate

LEANING = 0.15  # rad; what is tilted by more does not lie on a face
FLOATING = 0.015  # m, between a bottom and the top of what it is taken to lie on
DISTANCE_ERROR = 0.08  # m, by which a tag in a picture may seem further away than it is
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def levelled(pose: Pose) -> Pose | None:
    """The pose with its most vertical axis exactly vertical; None where no axis is nearly so."""
    ups = [rotate(pose.quaternion, axis) for axis in AXES]
    x, y, z = max(ups, key=lambda up: abs(up[2]))
    angle = math.atan2(math.hypot(x, y), abs(z))
    if angle > LEANING:
        return None
    sign = math.copysign(1.0, z)
    x, y, z = sign * x, sign * y, sign * z
    # The shortest turn that takes (x, y, z) to the vertical.
    turn = normalised((y, -x, 0.0, 1.0 + z))
    return Pose(pose.position, normalised(multiply(turn, pose.quaternion)))
