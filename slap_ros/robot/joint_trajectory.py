# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories of joints, as ros2_control's joint_trajectory_controller understands them.

Between two points each joint follows a straight line where points have positions only, a cubic
where they have velocities, and a quintic where they have accelerations. The first piece begins
where the arm stands when the trajectory starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidCommandError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrajectoryPoint:
    """Where the joints are to be at a time.

    Args:
        time_s: Time since the trajectory's start, s.
        positions: Positions, rad.
        velocities: Velocities, rad/s; empty: not given.
        accelerations: Accelerations, rad/s²; empty: not given.
    """

    time_s: float
    positions: tuple[float, ...]
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()


def require_followable(
    names: Sequence[str], joints: Sequence[str], points: Sequence[TrajectoryPoint]
) -> None:
    """Refuse what the controller refuses.

    Args:
        names: Joints of the trajectory.
        joints: Joints of the controller.
        points: Points of the trajectory, in the order of ``names``.

    Raises:
        InvalidCommandError: Joints are missing or unknown, there is no point, times do not
            increase, lists have other lengths, or the end is not at rest.
    """
    if sorted(names) != sorted(joints):
        raise InvalidCommandError(
            f"the trajectory is for {', '.join(names) or 'no joint'}; it must be for all of "
            f"{', '.join(joints)}"
        )
    if not points:
        raise InvalidCommandError("the trajectory has no point")
    for i, point in enumerate(points):
        _require_lists(i, point, len(joints))
    if points[0].time_s < 0.0 or any(b.time_s <= a.time_s for a, b in pairwise(points)):
        raise InvalidCommandError("times of the trajectory's points do not increase")
    if any(points[-1].velocities):
        raise InvalidCommandError("the trajectory does not end at rest")


def _require_lists(index: int, point: TrajectoryPoint, joints: int) -> None:
    sizes = (len(point.positions), len(point.velocities), len(point.accelerations))
    if sizes[0] != joints or not {sizes[1], sizes[2]} <= {0, joints}:
        raise InvalidCommandError(
            f"point {index} has {sizes[0]} positions, {sizes[1]} velocities and {sizes[2]} "
            f"accelerations for {joints} joints"
        )
    if not np.isfinite([*point.positions, *point.velocities, *point.accelerations]).all():
        raise InvalidCommandError(f"point {index} is not finite")


class JointSpline:
    """A trajectory that can be asked where the joints are to be at any time."""

    def __init__(
        self, points: Sequence[TrajectoryPoint], start: Array, start_velocity: Array
    ) -> None:
        """Join points by polynomials.

        Args:
            points: Points in the order of their times.
            start: Where the joints are at time 0, rad.
            start_velocity: How fast they are there, rad/s.
        """
        still = np.zeros(len(start))
        knots = [(0.0, start, start_velocity, still), *map(_knot, points)]
        if points[0].time_s == 0.0:
            del knots[0]
        self._times = [knot[0] for knot in knots]
        self._pieces = [_coefficients(a, b) for a, b in pairwise(knots)]
        self.end_s = self._times[-1]
        self.end = np.array(points[-1].positions)

    def at(self, time_s: float) -> Array:
        """Positions at a time since the start, rad; at the end, and after it, the last point's."""
        if time_s >= self.end_s:
            return self.end
        piece = max(0, int(np.searchsorted(self._times, time_s, side="right")) - 1)
        after = time_s - self._times[piece]
        coefficients = self._pieces[piece]
        found: Array = coefficients[-1]
        for lower in coefficients[-2::-1]:  # Horner: the same bits on every processor
            found = found * after + lower
        return found


Knot = tuple[float, Array, Array | None, Array | None]


def _knot(point: TrajectoryPoint) -> Knot:
    velocities = np.array(point.velocities) if point.velocities else None
    given = point.accelerations if point.velocities else ()
    return point.time_s, np.array(point.positions), velocities, np.array(given) if given else None


def _coefficients(a: Knot, b: Knot) -> Array:
    """Of powers of the time since ``a``, lowest first; shape (6, joints)."""
    t, p, q = b[0] - a[0], a[1], b[1]
    found = np.zeros((6, len(p)))
    found[0] = p
    if a[2] is None or b[2] is None:
        found[1] = (q - p) / t
        return found
    v, w = a[2], b[2]
    found[1] = v
    if a[3] is None or b[3] is None:
        found[2] = (3.0 * (q - p) - (2.0 * v + w) * t) / t**2
        found[3] = (2.0 * (p - q) + (v + w) * t) / t**3
        return found
    c, d = a[3], b[3]
    found[2] = 0.5 * c
    found[3] = (20.0 * (q - p) - (8.0 * w + 12.0 * v) * t - (3.0 * c - d) * t**2) / (2.0 * t**3)
    found[4] = (30.0 * (p - q) + (14.0 * w + 16.0 * v) * t + (3.0 * c - 2.0 * d) * t**2) / (
        2.0 * t**4
    )
    found[5] = (12.0 * (q - p) - 6.0 * (w + v) * t + (d - c) * t**2) / (2.0 * t**5)
    return found
