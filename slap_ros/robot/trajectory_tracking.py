# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Following a trajectory within tolerances, as ros2_control's joint_trajectory_controller does.

Time is the controller's own; nothing here waits. An outcome ends a motion: the controller then
holds the position in which the arm is, or the trajectory's end where that was reached.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from slap_ros.robot.joint_trajectory import JointSpline, TrajectoryPoint

Array = NDArray[np.float64]


class TrajectoryCode(IntEnum):
    """Codes of results, as ``control_msgs/FollowJointTrajectory`` has them."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


@dataclass(frozen=True)
class TrajectoryTolerances:
    """How far the arm may be off; 0: not checked.

    Args:
        path: On the way, of each joint, rad.
        goal: At the end, of each joint, rad.
        stopped: Velocity of each joint that stands at the end, rad/s.
        goal_time_s: How much later than asked the end may be reached, s.
    """

    path: tuple[float, ...]
    goal: tuple[float, ...]
    stopped: float = 0.01
    goal_time_s: float = 0.0


@dataclass(frozen=True)
class TrajectoryOutcome:
    """How a motion ended: a code, and why."""

    code: TrajectoryCode
    reason: str


class TrajectoryTracker:
    """One arm's controller: it holds, or follows one trajectory."""

    def __init__(self, joints: Sequence[float]) -> None:
        """Hold joint positions, rad."""
        self._hold = np.array(joints)
        self._spline: JointSpline | None = None
        self._tolerances: TrajectoryTolerances
        self._start_s = 0.0

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        return self._spline is not None

    def start(
        self,
        points: Sequence[TrajectoryPoint],
        tolerances: TrajectoryTolerances,
        now_s: float,
        joints: Sequence[float],
        velocities: Sequence[float],
    ) -> None:
        """Begin a motion, in place of the one under way.

        Args:
            points: Points of the trajectory.
            tolerances: How far off the arm may be.
            now_s: Time at which the trajectory starts, s.
            joints: Where the arm is, rad.
            velocities: How fast its joints are, rad/s.
        """
        self._spline = JointSpline(points, np.array(joints), np.array(velocities))
        self._tolerances, self._start_s = tolerances, now_s

    def hold(self, joints: Sequence[float]) -> None:
        """End the motion under way, if there is one, and hold these positions, rad."""
        self._spline, self._hold = None, np.array(joints)

    def command(self, now_s: float) -> Array:
        """Where the joints are to be now, rad."""
        if self._spline is None:
            return self._hold
        return self._spline.at(now_s - self._start_s)

    def check(
        self, now_s: float, joints: Sequence[float], velocities: Sequence[float]
    ) -> TrajectoryOutcome | None:
        """How the motion under way ended; None while it goes on, or where there is none.

        Args:
            now_s: Time, s.
            joints: Where the arm is, rad.
            velocities: How fast its joints are, rad/s.
        """
        if self._spline is None:
            return None
        off = np.abs(self.command(now_s) - np.array(joints))
        if now_s - self._start_s < self._spline.end_s:
            outcome = _on_the_way(off, self._tolerances)
        else:
            late_s = now_s - self._start_s - self._spline.end_s
            outcome = _at_the_end(off, velocities, late_s, self._tolerances)
        if outcome is not None:
            reached = outcome.code is TrajectoryCode.SUCCESSFUL
            self.hold(self._spline.end.tolist() if reached else joints)
        return outcome


def _on_the_way(off: Array, tolerances: TrajectoryTolerances) -> TrajectoryOutcome | None:
    if not (joint := _beyond(off, tolerances.path)):
        return None
    return TrajectoryOutcome(
        TrajectoryCode.PATH_TOLERANCE_VIOLATED,
        f"joint {joint} is {off[joint - 1]:.3f} rad off the path, which may be "
        f"{tolerances.path[joint - 1]} rad",
    )


def _at_the_end(
    off: Array, velocities: Sequence[float], late_s: float, tolerances: TrajectoryTolerances
) -> TrajectoryOutcome | None:
    joint = _beyond(off, tolerances.goal)
    fast = max(map(abs, velocities)) > tolerances.stopped > 0.0
    if not joint and not fast:
        return TrajectoryOutcome(TrajectoryCode.SUCCESSFUL, "")
    if late_s <= tolerances.goal_time_s or tolerances.goal_time_s == 0.0:
        return None
    what = f"joint {joint} is {off[joint - 1]:.3f} rad off" if joint else "the arm still moves"
    return TrajectoryOutcome(
        TrajectoryCode.GOAL_TOLERANCE_VIOLATED,
        f"{what}, {tolerances.goal_time_s} s after it should have arrived",
    )


def _beyond(off: Array, allowed: Sequence[float]) -> int:
    """The number, from 1, of a joint that is too far off; 0: none is."""
    return next((i for i, (a, b) in enumerate(zip(off, allowed, strict=True), 1) if a > b > 0.0), 0)
