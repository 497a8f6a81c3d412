# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time that nobody sets, for whatever lasts: deadlines, silence, periods.

The node's own clock may be set back or ahead at any moment, by NTP, by hand, or by a simulation
that begins again. It stamps messages, and nothing waits for it.
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
JUMP = 0.25  # s, by which a clock is off its own pace only if it was set


def create_timer(node: Node, period_s: float, callback: Callable[[], None]) -> Timer:
    """A timer that no clock that is set can stop.

    Args:
        node: Node whose executor calls back.
        period_s: Time between two calls, s.
        callback: What to call.

    Returns:
        The timer, to be destroyed by the node.
    """
    return node.create_timer(period_s, callback, clock=STEADY)


class JumpFreeClock:
    """The node's clock with its jumps taken out: for stamps of others that time is compared with.

    Whoever stamps measurements shares the node's clock, and so its jumps.
    """

    def __init__(self, node: Node) -> None:
        """Read the clock of ``node`` from now on."""
        self._node = node
        self._jumps_s = 0.0  # all of them so far
        self._read_s, self._steady_s = _node_time_s(node), monotonic()

    def now_s(self) -> float:
        """The time now, s, which never jumps."""
        read_s, steady_s = _node_time_s(self._node), monotonic()
        jump_s = (read_s - self._read_s) - (steady_s - self._steady_s)
        if abs(jump_s) > JUMP:
            self._jumps_s += jump_s
        self._read_s, self._steady_s = read_s, steady_s
        return read_s - self._jumps_s

    def of_stamp(self, stamp_s: float) -> float:
        """The time of a stamp that was made since the last jump, s."""
        self.now_s()
        return stamp_s - self._jumps_s


def _node_time_s(node: Node) -> float:
    return float(node.get_clock().now().nanoseconds) * 1e-9
