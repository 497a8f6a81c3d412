# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the fingers' motion is over: where they were told to be, or where something stops them."""

from __future__ import annotations

from enum import Enum

REACHED = 0.002  # m, of the gap, by which fingers that arrived may be off
STALLED = 0.001  # m/s, of the gap: slower fingers stand
STALL_TIME_S = 0.1  # for which they stand before they have stalled


class GripOutcome(Enum):
    """How a motion of the fingers ended."""

    REACHED = "reached"
    STALLED = "stalled"


class FingerTracker:
    """One gripper's controller: it notices when the fingers are there, or stand elsewhere."""

    def __init__(self) -> None:
        self._target: float | None = None  # m, of the gap
        self._moved_s = 0.0  # when the fingers moved last

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        return self._target is not None

    def start(self, gap: float, now_s: float) -> None:
        """Begin a motion to a gap, m, at a time, s."""
        self._target, self._moved_s = gap, now_s

    def stop(self) -> None:
        """End the motion under way."""
        self._target = None

    def check(self, now_s: float, gap: float, velocity: float) -> GripOutcome | None:
        """How the motion under way ended; None while it goes on, or where there is none.

        Args:
            now_s: Time, s.
            gap: Distance between the fingers, m.
            velocity: How fast they part, m/s.
        """
        if self._target is None:
            return None
        if abs(velocity) > STALLED:
            self._moved_s = now_s
        if now_s - self._moved_s < STALL_TIME_S:
            return None
        reached = abs(gap - self._target) <= REACHED
        self._target = None
        return GripOutcome.REACHED if reached else GripOutcome.STALLED
