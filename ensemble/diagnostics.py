# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The counts that every node publishes on ``diagnostics`` once per second."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from ensemble import encode
from ensemble.interfaces import DIAGNOSTICS
from ensemble.steady_time import create_timer

PERIOD = 1.0  # s


class DiagnosticsPublisher:
    """Publishes what a node counts, as its heartbeat."""

    def __init__(self, node: Node, counts: Callable[[], Mapping[str, object]]) -> None:
        """Publish as ``node``; ``counts`` is called for each message."""
        self._node = node
        self._counts = counts
        self._publisher = node.create_publisher(DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.qos)
        create_timer(node, PERIOD, self._publish)

    def _publish(self) -> None:
        name = self._node.get_fully_qualified_name()
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name=name,
            message="running",
            hardware_id=name,
            values=encode.key_values(self._counts()),
        )
        stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(DiagnosticArray(header=encode.header(stamp), status=[status]))
