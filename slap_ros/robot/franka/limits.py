# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an FR3 may do when franky plans its motions: the stricter of Franka's limits and franky's.

Franka's: https://frankarobotics.github.io/docs/robot_specifications.html. franky keeps joints
below the limits of the older arm, joint by joint. The arm's control has limits of torque besides;
it stops the arm where they are exceeded.
"""

from __future__ import annotations

from dataclasses import replace

from slap_ros.robot.limits import FR3, Joints, Limits

FRANKY_VELOCITY: Joints = (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)  # rad/s
FRANKY_ACCELERATION: Joints = (15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0)  # rad/s²
FRANKY_JERK: Joints = (7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0)  # rad/s³
FR3_JERK = 5000.0  # rad/s³, of each joint
FRANKA = replace(
    FR3,
    velocity=tuple(map(min, FR3.velocity, FRANKY_VELOCITY)),
    acceleration=tuple(map(min, FR3.acceleration, FRANKY_ACCELERATION)),
)
JERK: Joints = tuple(min(FR3_JERK, jerk) for jerk in FRANKY_JERK)  # rad/s³, at full speed


def franka_limits(limits: Limits, speed: float = 1.0) -> Limits:
    """The stricter of an arm's limits and of those at which a Franka arm is driven.

    Args:
        limits: Limits of the arm, at the fraction ``speed`` of its own.
        speed: Fraction of the limits of velocity and acceleration.
    """
    scaled = FRANKA.scaled(speed, limits.workspace)
    return replace(
        limits,
        low=tuple(map(max, limits.low, FRANKA.low)),
        high=tuple(map(min, limits.high, FRANKA.high)),
        velocity=tuple(map(min, limits.velocity, scaled.velocity)),
        acceleration=tuple(map(min, limits.acceleration, scaled.acceleration)),
    )
