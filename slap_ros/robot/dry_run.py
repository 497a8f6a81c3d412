# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded motion checked against the limits of an arm before anything moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from slap_ros.errors import UnsafeCommandError
from slap_ros.robot.limits import PEAK_ACCELERATION, PEAK_VELOCITY, JointMotion, Joints, Limits
from slap_ros.robot.recorded_motion import RecordedMotion
from slap_ros.worlds.panda import grasp_pose


@dataclass(frozen=True)
class Extreme:
    """The place of a motion that comes closest to a limit, or goes farthest beyond it."""

    quantity: str
    value: float
    low: float
    high: float
    unit: str
    step: int

    @property
    def share(self) -> float:
        """The share of the allowed range that the motion takes: more than 1 is too much."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return abs(self.value - middle) / half


@dataclass(frozen=True)
class DryRun:
    """A motion against the limits of an arm."""

    motions: tuple[JointMotion, ...]  # one a waypoint; fewer, if it must not be executed
    extremes: tuple[Extreme, ...]
    violations: tuple[tuple[int, str], ...]  # step and reason

    @classmethod
    def of(cls, recorded: RecordedMotion, limits: Limits) -> DryRun:
        """Check every waypoint: positions, velocities, accelerations, workspace. Nothing moves."""
        period_s = recorded.domain.execution.control_period_s
        planned: list[tuple[int, JointMotion]] = []
        violations = []
        at = recorded.start
        for waypoint in recorded.waypoints:
            try:
                motion = limits.motion(at, waypoint.joints, period_s)
                planned.append((waypoint.step, motion))
            except UnsafeCommandError as error:
                violations.append((waypoint.step, str(error)))
            at = waypoint.joints
        extremes = tuple(_extremes(recorded, limits, planned))
        return cls(tuple(motion for _, motion in planned), extremes, tuple(violations))

    @property
    def duration_s(self) -> float:
        """How long the arm moves."""
        return sum(motion.duration_s for motion in self.motions)

    def require_safe(self) -> None:
        """Refuse a motion that must not be executed.

        Raises:
            UnsafeCommandError: Says where it first goes too far, and how often.
        """
        if self.violations:
            step, reason = self.violations[0]
            raise UnsafeCommandError(
                f"step {step} of the recording: {reason}; "
                f"{len(self.violations)} of its steps go beyond the limits of this arm"
            )


def _extremes(
    recorded: RecordedMotion, limits: Limits, planned: Sequence[tuple[int, JointMotion]]
) -> Iterator[Extreme]:
    """What comes closest to each limit, of a recording and of its motions by step."""
    places = [(0, recorded.start), *((w.step, w.joints) for w in recorded.waypoints)]
    yield _worst(
        Extreme(f"joint {i + 1}", q[i], limits.low[i], limits.high[i], "rad", step)
        for step, q in places
        for i in range(len(q))
    )
    ways = [
        (b_step, i, b[i] - a[i]) for (_, a), (b_step, b) in pairwise(places) for i in range(len(a))
    ]
    yield _worst(
        Extreme(f"joint {i + 1} in a step", way, -limits.step[i], limits.step[i], "rad", step)
        for step, i, way in ways
    )
    for name, unit, peak, allowed in (
        ("velocity", "rad/s", _peak_velocity, limits.velocity),
        ("acceleration", "rad/s²", _peak_acceleration, limits.acceleration),
    ):
        yield _worst(_peaks(name, unit, peak, allowed, planned))
    points = [(step, grasp_pose(q).position) for step, q in places]
    box = limits.workspace
    for i, axis in enumerate("xyz"):
        yield _worst(
            Extreme(f"fingertips {axis}", point[i], box.low[i], box.high[i], "m", step)
            for step, point in points
        )


def _peaks(
    name: str,
    unit: str,
    peak: Callable[[float, float], float],
    allowed: Joints,
    planned: Sequence[tuple[int, JointMotion]],
) -> Iterator[Extreme]:
    yield Extreme(f"{name} of joint 1", 0.0, -allowed[0], allowed[0], unit, 0)
    for step, motion in planned:
        for i, (a, b) in enumerate(zip(motion.start, motion.target, strict=True)):
            value = peak(abs(b - a), motion.duration_s)
            yield Extreme(f"{name} of joint {i + 1}", value, -allowed[i], allowed[i], unit, step)


def _peak_velocity(way: float, duration_s: float) -> float:
    return PEAK_VELOCITY * way / duration_s


def _peak_acceleration(way: float, duration_s: float) -> float:
    return PEAK_ACCELERATION * way / duration_s**2


def _worst(extremes: Iterator[Extreme]) -> Extreme:
    return max(extremes, key=lambda extreme: extreme.share)
