# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Awaiting things in callbacks, without blocking the executor."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from concurrent.futures import Future as Job
from typing import TypeVar

from rclpy.node import Node
from rclpy.task import Future

from ensemble.steady_time import create_timer

T = TypeVar("T")
POLL_PERIOD = 0.02  # s, between two looks at a condition


def submit(workers: Executor, function: Callable[[], T]) -> Future:
    """Run something long in a worker thread; the future's result is the finished job."""
    done = Future()
    workers.submit(function).add_done_callback(done.set_result)
    return done


async def run_in_executor(workers: Executor, function: Callable[[], T]) -> T:
    """Run something long in a worker thread; what it raises is raised here."""
    job: Job[T] = await submit(workers, function)
    return job.result()


async def wait_for_first(node: Node, future: Future, condition: Callable[[], bool]) -> bool:
    """Wait for a future or for a condition, whichever comes first.

    Args:
        node: Node whose timer checks the condition, every ``POLL_PERIOD``.
        future: What to wait for.
        condition: What else to wait for.

    Returns:
        Whether the future is done.
    """
    ended = Future()

    def end(_: object = None) -> None:
        if not ended.done():
            ended.set_result(None)

    def poll() -> None:
        if condition():
            end()

    future.add_done_callback(end)
    timer = create_timer(node, POLL_PERIOD, poll)
    try:
        await ended
    finally:
        node.destroy_timer(timer)
    return bool(future.done())


async def wait_until(node: Node, condition: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    if not condition():
        await wait_for_first(node, Future(), condition)
