# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motions through several waypoints without a stop, within limits of velocity, acceleration, jerk.

At a waypoint each joint has the harmonic mean of its velocities in the two steps around it, and
none where it turns (Fritsch and Butland 1984): so it never passes the position that it was
commanded to, not even for a moment. Between two waypoints it follows a quintic without acceleration
at either end. Steps are as short as the limits allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import Joints, Limits

Array = NDArray[np.float64]
ROUNDS = 150  # of shortening and lengthening steps
LONGER = 1.005  # factor by which a step that goes beyond a limit is lengthened, at least
SHORTEST = 0.5  # factor by which a step is shortened in a round, at most
TOLERANCE = 1e-6  # share by which a limit may be exceeded, as numbers are rounded
SAMPLES = 33  # places in a step at which limits are checked
STANDS = 1e-9  # rad; a step of less is none
ORDERS = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True)
class MotionLimits:
    """The largest velocity, acceleration and jerk of each joint: rad/s, rad/s², rad/s³."""

    velocity: Joints
    acceleration: Joints
    jerk: Joints

    @classmethod
    def of(cls, limits: Limits, jerk: Joints) -> MotionLimits:
        """Those of an arm, with the largest jerk, rad/s³."""
        return cls(limits.velocity, limits.acceleration, jerk)

    def rows(self) -> Array:
        """Limits by order of the derivative; shape (3, joints)."""
        return np.array((self.velocity, self.acceleration, self.jerk))


@dataclass(frozen=True)
class BlendedMotion:
    """A motion through waypoints, from rest to rest.

    Args:
        start: Where it begins, rad.
        points: Waypoints with times and velocities. The last one is at rest.
        peaks: Largest velocity, acceleration and jerk of each joint in each step; shape
            (steps, 3, joints).
    """

    start: Joints
    points: tuple[TrajectoryPoint, ...]
    peaks: Array

    @property
    def duration_s(self) -> float:
        """How long it takes, s."""
        return self.points[-1].time_s


def blend(waypoints: Sequence[Joints], limits: MotionLimits, least_s: float) -> BlendedMotion:
    """Join waypoints by a motion that stops at the last one only.

    Args:
        waypoints: Joint positions, rad; the first one is where the arm stands.
        limits: What the motion must keep to.
        least_s: Least duration of a step, s.

    Returns:
        The motion: a point for each waypoint but the first.
    """
    places, allowed = np.array(waypoints), limits.rows()
    durations = np.full(len(places) - 1, least_s)
    for _ in range(ROUNDS):  # towards the limits, from both sides
        factors = _factors(places, durations, allowed)
        durations = np.maximum(least_s, durations * np.sqrt(factors))
    while (beyond := (factors := _factors(places, durations, allowed)) > 1.0 + TOLERANCE).any():
        durations = np.where(beyond, durations * np.maximum(factors, LONGER), durations)
    velocities = _velocities(places, durations)
    peaks = step_peaks(places, velocities, durations)
    return BlendedMotion(tuple(waypoints[0]), _points(places, velocities, durations), peaks)


def _factors(places: Array, durations: Array, allowed: Array) -> Array:
    """By what each step must be longer to keep to the limits; below 1: it may be shorter.

    A longer step lowers velocity by as much, acceleration by its square, jerk by its cube.
    """
    shares = step_peaks(places, _velocities(places, durations), durations) / allowed
    found: Array = np.max(shares.max(axis=2) ** (1.0 / np.arange(1, 4)), axis=1)
    return np.maximum(found, SHORTEST)


def _velocities(places: Array, durations: Array) -> Array:
    """Velocities at the waypoints; shape (waypoints, joints)."""
    steps = np.diff(places, axis=0) / durations[:, None]
    before, after = steps[:-1], steps[1:]
    goes_on = before * after > 0.0
    sums = np.where(goes_on, before + after, 1.0)
    found = np.zeros_like(places)
    found[1:-1] = np.where(goes_on, 2.0 * before * after / sums, 0.0)
    return found


def step_peaks(places: Array, velocities: Array, durations: Array) -> Array:
    """Largest velocity, acceleration and jerk of each step's quintic.

    Args:
        places: Positions at the waypoints, rad; shape (waypoints, joints).
        velocities: Velocities there, rad/s; same shape.
        durations: Durations of the steps between them, s.

    Returns:
        Absolute values; shape (steps, 3, joints).
    """
    t = durations[:, None]
    p = np.diff(places, axis=0)
    v, w = velocities[:-1] * t, velocities[1:] * t
    # Coefficients of s, s³, s⁴ and s⁵, where s goes from 0 to 1.
    third = 10.0 * p - 4.0 * w - 6.0 * v
    fourth = -15.0 * p + 7.0 * w + 8.0 * v
    fifth = 6.0 * p - 3.0 * w - 3.0 * v
    s = np.linspace(0.0, 1.0, SAMPLES)[:, None, None]
    derivatives = (
        (v + 3.0 * third * s**2 + 4.0 * fourth * s**3 + 5.0 * fifth * s**4) / t,
        (6.0 * third * s + 12.0 * fourth * s**2 + 20.0 * fifth * s**3) / t**2,
        (6.0 * third + 24.0 * fourth * s + 60.0 * fifth * s**2) / t**3,
    )
    return np.stack([np.abs(one).max(axis=0) for one in derivatives], axis=1)


def _points(places: Array, velocities: Array, durations: Array) -> tuple[TrajectoryPoint, ...]:
    still = (0.0,) * places.shape[1]
    return tuple(
        TrajectoryPoint(float(time_s), tuple(place), tuple(velocity), still)
        for time_s, place, velocity in zip(
            np.cumsum(durations), places[1:].tolist(), velocities[1:].tolist(), strict=True
        )
    )
