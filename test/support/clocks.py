# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A clock that every node of a test goes by, and that can be set."""

from time import monotonic_ns, time_ns

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from ensemble.steady_time import create_timer

BY_THE_CLOCK = {"use_sim_time": True}  # parameter of a node that goes by it
PERIOD = 0.005  # s, between two ticks
NANOSECONDS = 1_000_000_000  # in a second


class SettableClock(Node):
    """Publishes ``/clock``, which passes as time does until it is set."""

    def __init__(self):
        super().__init__("clock")
        self._offset_ns = time_ns() - monotonic_ns()
        self._ticks = self.create_publisher(
            Clock, "/clock", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        )
        create_timer(self, PERIOD, self._tick)

    def set_by(self, seconds):
        """Set it ahead, or back."""
        self._offset_ns += int(seconds * NANOSECONDS)
        self._tick()

    def _tick(self):
        now = Clock()
        now.clock.sec, now.clock.nanosec = divmod(monotonic_ns() + self._offset_ns, NANOSECONDS)
        self._ticks.publish(now)
