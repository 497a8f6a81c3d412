# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executors, callback groups, futures and coroutines."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String

from conftest import TIMEOUT_S, spin_until, wait_until


@pytest.fixture
def no_look_around(monkeypatch: pytest.MonkeyPatch) -> None:
    """Executors wait until they are woken, instead of looking around once a second."""
    monkeypatch.setattr("rclpy.executors._MAX_WAIT_NS", int(100 * TIMEOUT_S * 1e9))


class Overlap:
    """Counts how many callbacks run at the same time."""

    def __init__(self) -> None:
        self.most = self.calls = 0
        self._now = 0
        self._lock = threading.Lock()

    def __call__(self) -> None:
        with self._lock:
            self._now += 1
            self.calls += 1
            self.most = max(self.most, self._now)
        time.sleep(0.03)
        with self._lock:
            self._now -= 1


def spin_in_threads(node: Node, condition: Callable[[], bool], threads: int = 4) -> bool:
    executor = MultiThreadedExecutor(threads)
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    reached = wait_until(condition)
    executor.shutdown()
    spinner.join()
    return reached


def test_a_mutually_exclusive_group_runs_one_callback_at_a_time(node: Node) -> None:
    overlap, group = Overlap(), MutuallyExclusiveCallbackGroup()
    for _ in range(3):
        node.create_timer(0.001, overlap, callback_group=group)
    assert spin_in_threads(node, lambda: overlap.calls > 8)
    assert overlap.most == 1


def test_a_reentrant_group_runs_many_at_once(node: Node) -> None:
    overlap, group = Overlap(), ReentrantCallbackGroup()
    node.create_timer(0.001, overlap, callback_group=group)
    assert spin_in_threads(node, lambda: overlap.calls > 8 and overlap.most >= 3, threads=3)
    assert overlap.most == 3


def test_groups_do_not_hold_each_other_up(node: Node) -> None:
    release = threading.Event()
    ticks: list[int] = []
    node.create_timer(0.001, lambda: release.wait(10), MutuallyExclusiveCallbackGroup())
    node.create_timer(0.001, lambda: ticks.append(1), MutuallyExclusiveCallbackGroup())
    executor = MultiThreadedExecutor(2)
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    assert wait_until(lambda: len(ticks) > 5)
    release.set()
    executor.shutdown()
    spinner.join()


def test_messages_for_a_busy_group_are_not_lost(node: Node) -> None:
    received: list[str] = []
    group = MutuallyExclusiveCallbackGroup()

    def slowly(message: String) -> None:
        time.sleep(0.01)
        received.append(message.data)

    node.create_subscription(String, "topic", slowly, 50, callback_group=group)
    publisher = node.create_publisher(String, "topic", 50)
    for index in range(20):
        publisher.publish(String(data=str(index)))
    assert spin_in_threads(node, lambda: len(received) == 20)
    assert received == [str(index) for index in range(20)]


@pytest.mark.parametrize("executor_class", [SingleThreadedExecutor, MultiThreadedExecutor])
def test_waiting_coroutines_cost_nothing(node: Node, executor_class: type) -> None:
    waited_for = [Future() for _ in range(20)]
    begun: list[Future] = []
    results: list[int] = []

    async def wait(future: Future) -> None:
        begun.append(future)
        results.append(await future)

    executor = executor_class()
    executor.add_node(node)
    for future in waited_for:
        executor.create_task(wait(future))
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    assert wait_until(lambda: len(begun) == 20)
    time.sleep(0.1)  # the executor's own way back to sleep
    began = time.process_time()  # which other processes do not count towards
    time.sleep(1.0)
    used = time.process_time() - began
    for index, future in enumerate(waited_for):  # from another thread
        future.set_result(index)
    assert wait_until(lambda: len(results) == 20)
    executor.shutdown()
    spinner.join()
    assert sorted(results) == list(range(20))
    assert used < 0.3, f"{used:.3f} s of processor time in 1 s of waiting"


@pytest.mark.usefixtures("no_look_around")
def test_a_result_from_another_thread_wakes_the_executor(node: Node) -> None:
    future: Future = Future()
    timer = threading.Timer(0.1, future.set_result, [5])
    timer.start()
    began = time.monotonic()
    rclpy.spin_until_future_complete(node, future, timeout_sec=2 * TIMEOUT_S)
    assert future.result() == 5
    assert time.monotonic() - began < TIMEOUT_S  # not the end of the wait


@pytest.mark.parametrize("executor_class", [SingleThreadedExecutor, MultiThreadedExecutor])
def test_exceptions_leave_spin(node: Node, executor_class: type) -> None:
    def fail() -> None:
        timer.cancel()  # once: with several threads the next call may be under way already
        raise ZeroDivisionError("in a callback")

    timer = node.create_timer(0.01, fail)
    executor = executor_class()
    executor.add_node(node)
    with pytest.raises(ZeroDivisionError, match="in a callback"):
        executor.spin()
    again = executor.create_task(lambda: 1)
    executor.spin_until_future_complete(again, timeout_sec=TIMEOUT_S)
    assert again.result() == 1
    executor.shutdown()


def test_exceptions_in_coroutines_leave_spin(node: Node) -> None:
    ready: Future = Future()

    async def fail(message: String) -> None:
        await ready
        raise ZeroDivisionError("later")

    node.create_subscription(String, "topic", fail, 10)
    node.create_publisher(String, "topic", 10).publish(String())
    rclpy.spin_once(node, timeout_sec=TIMEOUT_S)
    ready.set_result(None)
    with pytest.raises(ZeroDivisionError, match="later"):
        spin_until(node, lambda: False)


def test_a_coroutine_holds_its_group(node: Node) -> None:
    future: Future = Future()
    order: list[str] = []

    async def slowly(message: String) -> None:
        order.append("begin")
        await future
        order.append("end")

    node.create_subscription(String, "topic", slowly, 10)
    publisher = node.create_publisher(String, "topic", 10)
    publisher.publish(String())
    publisher.publish(String())
    assert spin_until(node, lambda: bool(order))
    spin_until(node, lambda: False, 0.2)
    assert order == ["begin"]
    future.set_result(None)
    assert spin_until(node, lambda: len(order) == 4)
    assert order == ["begin", "end", "begin", "end"]


def test_timers(node: Node) -> None:
    calls: list[float] = []
    slow = node.create_timer(1000.0, lambda: calls.append(0))
    assert 0 < slow.time_until_next_call() <= 1000 * 10**9
    timer = node.create_timer(0.05, lambda: calls.append(time.monotonic()))
    assert timer.time_until_next_call() <= 50_000_000
    assert spin_until(node, lambda: len(calls) == 4)
    # Where the first is late, the second follows at once and the third as soon as it is due.
    assert calls[-1] - calls[0] > 0.049
    timer.cancel()
    assert timer.is_canceled()
    assert timer.time_until_next_call() is None
    spin_until(node, lambda: False, 0.15)
    assert len(calls) == 4
    timer.reset()
    assert spin_until(node, lambda: len(calls) == 5)
    idle = node.create_timer(0.01, lambda: calls.append(0), autostart=False)
    timer.cancel()
    spin_until(node, lambda: False, 0.05)
    assert len(calls) == 5
    assert idle.is_canceled()


def test_a_late_timer_does_not_catch_up(node: Node) -> None:
    calls: list[int] = []
    node.create_timer(0.01, lambda: calls.append(1))
    time.sleep(0.2)
    began = time.monotonic()
    assert spin_until(node, lambda: bool(calls) and time.monotonic() - began > 0.05)
    calls_due = (time.monotonic() - began) / 0.01
    assert len(calls) <= calls_due + 2  # not the 20 before as well


def test_guard_conditions(node: Node) -> None:
    calls: list[int] = []
    guard = node.create_guard_condition(lambda: calls.append(1))
    rclpy.spin_once(node, timeout_sec=0.02)
    assert calls == []
    threading.Timer(0.05, guard.trigger).start()
    assert spin_until(node, lambda: calls == [1])
    assert node.destroy_guard_condition(guard)


def test_futures() -> None:
    future: Future = Future()
    seen: list[Future] = []
    future.add_done_callback(seen.append)
    assert not future.done()
    future.set_result(1)
    assert seen == [future]
    future.add_done_callback(seen.append)
    assert len(seen) == 2
    failed: Future = Future()
    failed.set_exception(KeyError("x"))
    with pytest.raises(KeyError):
        failed.result()
    cancelled: Future = Future()
    cancelled.cancel()
    assert cancelled.cancelled()
    assert not cancelled.done()


def test_tasks(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    first = executor.create_task(lambda a, b: a + b, 1, b=2)
    executor.spin_until_future_complete(first, timeout_sec=TIMEOUT_S)
    assert first.result() == 3

    async def chain() -> int:
        return await executor.create_task(lambda: 4) + 1

    second = executor.create_task(chain())
    executor.spin_until_future_complete(second, timeout_sec=TIMEOUT_S)
    assert second.result() == 5
    never = executor.create_task(chain_forever())
    executor.spin_once(timeout_sec=0.1)
    never.cancel()
    executor.spin_once(timeout_sec=0.1)
    assert never.cancelled()
    executor.shutdown()


async def chain_forever() -> None:
    await Future()


@pytest.mark.usefixtures("no_look_around")
def test_entities_created_while_spinning_are_served(node: Node) -> None:
    received: list[str] = []
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    assert wait_until(executor.create_task(lambda: None).done)
    time.sleep(0.1)  # the executor's own way back to sleep
    node.create_subscription(String, "topic", lambda m: received.append(m.data), 10)
    node.create_publisher(String, "topic", 10).publish(String(data="x"))
    assert wait_until(lambda: received == ["x"])
    executor.shutdown()
    spinner.join()


def test_a_node_is_on_one_executor(node: Node) -> None:
    first, second = SingleThreadedExecutor(), SingleThreadedExecutor()
    assert first.add_node(node)
    assert not first.add_node(node)
    assert second.add_node(node)
    assert first.get_nodes() == []
    assert node.executor is second
    second.shutdown()
    assert node.executor is None


def test_shutdown_from_another_thread_ends_spin(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    threading.Timer(0.2, rclpy.try_shutdown).start()
    with pytest.raises(ExternalShutdownException):
        executor.spin()


def test_shutdown_from_a_callback_ends_spin(node: Node) -> None:
    node.create_timer(0.01, rclpy.shutdown)
    rclpy.spin(node)
    assert not rclpy.ok()


def test_rates_and_sleeping(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    rate = node.create_rate(50)
    began = time.monotonic()
    for _ in range(5):
        rate.sleep()
    assert time.monotonic() - began > 0.03  # 0.1 s where none of the ticks is late
    node.destroy_rate(rate)
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    assert clock.sleep_for(rclpy.duration.Duration(seconds=0.02))
    executor.shutdown()
    spinner.join()


def test_two_contexts_are_apart(domain: int, other_domain: int) -> None:
    contexts = [rclpy.Context(), rclpy.Context()]
    nodes = []
    for context, number in zip(contexts, (domain, other_domain), strict=True):
        rclpy.init(args=[], context=context, domain_id=number)
        nodes.append(Node("same", context=context))
    assert [node.context.get_domain_id() for node in nodes] == [domain, other_domain]
    assert nodes[0].get_node_names() == ["same"]
    executor = SingleThreadedExecutor(context=contexts[0])
    rclpy.shutdown(context=contexts[1])
    assert contexts[0].ok()
    done = executor.create_task(lambda: 1)
    executor.add_node(nodes[0])
    executor.spin_until_future_complete(done, timeout_sec=TIMEOUT_S)
    assert done.result() == 1
    executor.shutdown()
    rclpy.shutdown(context=contexts[0])
