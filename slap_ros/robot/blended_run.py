# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded motion without stops, checked against the limits of an arm before anything moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slap_ros.robot.blending import ORDERS, BlendedMotion, MotionLimits
from slap_ros.robot.dry_run import DryRun, Extreme
from slap_ros.robot.limits import Joints, Limits
from slap_ros.robot.recorded_motion import RecordedMotion
from slap_ros.robot.stretches import Stretch, blended_stretches

UNITS = dict(zip(ORDERS, ("rad/s", "rad/s²", "rad/s³"), strict=True))


@dataclass(frozen=True)
class BlendedRun(DryRun):
    """A motion that stops only where the gripper acts, against the limits of an arm.

    Args:
        stretches: Parts of the motion, which the arm executes one after the other.
    """

    stretches: tuple[Stretch, ...] = ()

    @classmethod
    def without_stops(cls, recorded: RecordedMotion, limits: Limits, jerk: Joints) -> BlendedRun:
        """Check every waypoint, and the motion through them. Nothing moves.

        Args:
            recorded: Motion to check.
            limits: Limits of the arm.
            jerk: Largest jerk of each joint, rad/s³.

        Returns:
            The motion with what it takes of each limit.
        """
        checked = DryRun.of(recorded, limits)
        kept = MotionLimits.of(limits, jerk)
        period_s = recorded.domain.execution.control_period_s
        parts = blended_stretches(recorded.start, recorded.waypoints, kept, period_s)
        places = [e for e in checked.extremes if not e.quantity.startswith(ORDERS)]
        moving = [_worst(order, parts, kept) for order in range(len(ORDERS))]
        return cls(
            checked.motions,
            (*places[:2], *moving, *places[2:]),
            checked.violations,
            tuple(stretch for stretch, _ in parts),
        )

    @property
    def duration_s(self) -> float:
        """How long the arm moves."""
        return sum(stretch.duration_s for stretch in self.stretches)


def _worst(
    order: int, parts: list[tuple[Stretch, BlendedMotion | None]], limits: MotionLimits
) -> Extreme:
    return max(_peaks(order, parts, limits), key=lambda extreme: extreme.share)


def _peaks(
    order: int, parts: list[tuple[Stretch, BlendedMotion | None]], limits: MotionLimits
) -> Iterator[Extreme]:
    """The largest derivative of an order of each joint in each step."""
    name, allowed = ORDERS[order], limits.rows()[order]
    unit = UNITS[name]
    yield Extreme(f"{name} of joint 1", 0.0, -allowed[0], allowed[0], unit, 0)
    for stretch, motion in parts:
        if motion is None:
            continue
        for step, row in zip(stretch.steps, motion.peaks[:, order], strict=True):
            for i, peak in enumerate(row.tolist()):
                limit = float(allowed[i])
                yield Extreme(f"{name} of joint {i + 1}", peak, -limit, limit, unit, step)
