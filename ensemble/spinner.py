# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A short-lived node on the network, spun while something is waited for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from time import monotonic
from typing import TypeVar

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ensemble.network import start_node

SPIN_PERIOD = 0.05  # s, the longest time between two checks

N = TypeVar("N", bound=Node)


class Spinner:
    """Spins an executor until a condition holds, and calls ``check`` meanwhile."""

    def __init__(self, executor: Executor) -> None:
        self.check: Callable[[], None] = lambda: None
        self.executor = executor

    def spin_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Spin until a condition holds, for at most ``timeout_s``.

        Returns:
            Whether it came to hold in time.

        Raises:
            NodeDiedError: A node ended meanwhile, if ``check`` finds that out.
        """
        end = monotonic() + timeout_s
        while not condition():
            if monotonic() > end:
                return False
            self.executor.spin_once(timeout_sec=SPIN_PERIOD)
            self.check()
        return True


@contextmanager
def temporary_node(make: Callable[[], N]) -> Iterator[tuple[N, Spinner]]:
    """Join the network with a node, and leave it at the end.

    No signal handlers: after Ctrl-C there still is something to be canceled and closed.

    Raises:
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
    """
    with ExitStack() as stack:
        stack.callback(rclpy.try_shutdown)
        node = start_node(
            make,
            args=["--ros-args", "--log-level", "warn"],
            signal_handler_options=SignalHandlerOptions.NO,
        )
        executor = SingleThreadedExecutor()
        stack.callback(executor.shutdown)
        stack.callback(node.destroy_node)
        executor.add_node(node)
        yield node, Spinner(executor)
