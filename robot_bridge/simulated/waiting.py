# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waiting without blocking whoever waits beside."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.task import Future

from ensemble.steady_time import create_timer


async def pause(node: Node, duration_s: float) -> None:
    """Wait without blocking the executor."""
    over = Future()
    timer = create_timer(node, max(duration_s, 1e-3), lambda: over.done() or over.set_result(None))
    try:
        await over
    finally:
        node.destroy_timer(timer)
