# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the fingers' motion is over: where they were told to be, or where something stops them."""

from __future__ import annotations

from enum import Enum

REACHED = 0.002  # m, of the gap, by which fingers that arrived may be off
STALLED = 0.001  # m/s, of the gap: slower fingers stand
STALL_TIME_S = 0.1  # for which they stand before they have stalled
# Fingers on a round thing may tremble for ever: fast, and nowhere.
TREMBLING = 0.0005  # m, of the gap, within which they do
TREMBLE_TIME_S = 0.5  # for which they do before they have stalled


class GripOutcome(Enum):
    """How a motion of the fingers ended."""

    REACHED = "reached"
    STALLED = "stalled"


class FingerTracker:
    """One gripper's controller: it notices when the fingers are there, or stand elsewhere."""

    def __init__(self) -> None:
        self._target: float | None = None  # m, of the gap
        self._moved_s = 0.0  # when the fingers moved last
        self._around: tuple[float, float] | None = None  # m, of the gap, and since when, s

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        return self._target is not None

    def start(self, gap: float, now_s: float) -> None:
        """Begin a motion to a gap, m, at a time, s."""
        self._target, self._moved_s, self._around = gap, now_s, None

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
        if now_s - self._moved_s < STALL_TIME_S and not self._trembles(now_s, gap):
            return None
        reached = abs(gap - self._target) <= REACHED
        self._target = None
        return GripOutcome.REACHED if reached else GripOutcome.STALLED

    def _trembles(self, now_s: float, gap: float) -> bool:
        """Whether the fingers have gone nowhere for a while, however fast."""
        if self._around is None or abs(gap - self._around[0]) > TREMBLING:
            self._around = gap, now_s
        return now_s - self._around[1] >= TREMBLE_TIME_S
