# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starting, stopping, signals, and leaving nothing behind."""

from __future__ import annotations

import gc
import os
import signal
import threading
import time
from collections.abc import Callable

import pytest
import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    NotInitializedException,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

from conftest import TIMEOUT_S, Process, wait_until
from embedded_ros.transport.config import LEASE_DURATION_S

Run = Callable[..., Process]

MAIN = """
import sys
import time
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

rclpy.init(args=sys.argv)
node = Node("main")
try:
    print("ready", flush=True)
    {spin}
except (KeyboardInterrupt, ExternalShutdownException) as error:
    print(type(error).__name__, rclpy.ok())
finally:
    node.destroy_node()
    rclpy.try_shutdown()
"""
SPINS = {
    "spin": "rclpy.spin(node)",
    "timer": "node.create_timer(0.001, lambda: None); rclpy.spin(node)",
    "many": (
        "from rclpy.executors import MultiThreadedExecutor; e = MultiThreadedExecutor(2); "
        "e.add_node(node); e.spin()"
    ),
}


@pytest.mark.parametrize("spin", SPINS)
@pytest.mark.parametrize(
    ("number", "exception"),
    [(signal.SIGINT, "KeyboardInterrupt"), (signal.SIGTERM, "ExternalShutdownException")],
)
def test_signals_end_the_usual_main_cleanly(
    run: Run, number: signal.Signals, exception: str, spin: str
) -> None:
    process = run(code=MAIN.format(spin=SPINS[spin]))
    process.wait_for_line("ready")
    time.sleep(0.1)  # into the wait; a signal before it must do as well
    process.send(number)
    code, out, err = process.finish()
    assert (code, out.strip(), err) == (0, f"{exception} False", "")


def test_sigterm_without_spin_is_seen_by_ok(run: Run) -> None:
    loop = "\n    while rclpy.ok():\n        time.sleep(0.01)\n    print('over')"
    process = run(code=MAIN.format(spin=loop))
    process.wait_for_line("ready")
    process.send(signal.SIGTERM)
    assert process.finish() == (0, "over\n", "")


def test_cycles_leave_nothing_behind(domain: int) -> None:
    def cycle() -> None:
        rclpy.init(args=[], domain_id=domain)
        node = Node("n")
        received: list[String] = []
        node.create_subscription(String, "t", received.append, 10)
        node.create_publisher(String, "t", 10).publish(String(data="x"))
        rclpy.spin_once(node, timeout_sec=TIMEOUT_S)
        assert received == [String(data="x")]
        node.destroy_node()
        rclpy.shutdown()

    def resources() -> tuple[int, int, int]:
        gc.collect()
        return (
            len(os.listdir("/proc/self/fd")),
            len(os.listdir("/proc/self/task")),
            threading.active_count(),
        )

    def nothing_left() -> bool:
        return all(now <= then for now, then in zip(resources(), before, strict=True))

    cycle()
    before = resources()
    for _ in range(50):
        cycle()
    # The kernel lists a thread for a moment after it was joined.
    assert wait_until(nothing_left), (before, resources())


def test_nodes_that_were_not_destroyed_do_not_outlive_shutdown(domain: int) -> None:
    before = len(os.listdir("/proc/self/fd"))
    rclpy.init(args=[], domain_id=domain)
    node = Node("left")
    publisher = node.create_publisher(String, "t", 10)
    rclpy.shutdown()
    assert len(os.listdir("/proc/self/fd")) <= before
    with pytest.raises(RuntimeError, match="publisher's context is invalid"):
        publisher.publish(String())
    node.get_logger().info("still works")
    node.destroy_node()


def test_signal_handlers_are_restored(domain: int) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    rclpy.init(args=[], domain_id=domain)
    assert signal.getsignal(signal.SIGINT) != before[0]
    rclpy.shutdown()
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_misuse_is_refused(domain: int) -> None:
    with pytest.raises(NotInitializedException):
        Node("n")
    with pytest.raises(RuntimeError, match="before it can be shutdown"):
        rclpy.shutdown()
    rclpy.try_shutdown()
    rclpy.init(args=[], domain_id=domain)
    with pytest.raises(RuntimeError, match="only be called once"):
        rclpy.init(args=[])
    for name in ("", "a-b", "1a", "a/b"):
        with pytest.raises(InvalidNodeNameException):
            Node(name)
    for namespace in ("/a//b", "/1", "/a b"):
        with pytest.raises(InvalidNamespaceException):
            Node("n", namespace=namespace)
    with pytest.raises(NotImplementedError, match="logger service"):
        Node("n", enable_logger_service=True)
    rclpy.shutdown()
    with pytest.raises(RCLError, match="domain 233 is not in"):
        rclpy.init(args=[], domain_id=233)


def test_the_domain_comes_from_the_environment(
    monkeypatch: pytest.MonkeyPatch, domain: int
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    rclpy.init(args=[])
    assert rclpy.get_default_context().get_domain_id() == domain
    rclpy.shutdown()
    monkeypatch.setenv("ROS_DOMAIN_ID", "many")
    with pytest.raises(RCLError, match="ROS_DOMAIN_ID is 'many'"):
        rclpy.init(args=[])
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "WORLD")
    with pytest.raises(RCLError, match="ROS_AUTOMATIC_DISCOVERY_RANGE is 'WORLD'"):
        rclpy.init(args=[])


def test_a_network_that_cyclonedds_refuses_is_an_rclerror(
    monkeypatch: pytest.MonkeyPatch, domain: int
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "<CycloneDDS><Domain")
    rclpy.init(args=[], domain_id=domain)
    with pytest.raises(RCLError, match="check CYCLONEDDS_URI"):
        Node("n")
    monkeypatch.delenv("CYCLONEDDS_URI")
    Node("n").destroy_node()  # nothing stays behind
    rclpy.shutdown()


def test_an_idle_node_sleeps(run: Run) -> None:
    spin = (
        "import os, threading; "
        "threading.Timer(3.0, lambda: os.kill(os.getpid(), 15)).start(); "
        "began = time.process_time(); rclpy.spin(node)"
    )
    code = MAIN.format(spin=spin).replace("rclpy.ok())", "time.process_time() - began)")
    status, out, _ = run(code=code).finish()
    assert status == 0
    assert float(out.split()[-1]) < 0.6  # s of processor time: one that never sleeps takes 3 s


def test_a_stopped_reader_does_not_freeze_the_publisher(run: Run, domain: int) -> None:
    process = run("echo")
    process.wait_for_line("ready")
    rclpy.init(args=[], domain_id=domain)
    node = Node("n")
    publisher = node.create_publisher(String, "in", 10)
    assert wait_until(lambda: publisher.get_subscription_count() > 0)
    process.send(signal.SIGSTOP)
    began = time.monotonic()
    for _ in range(200):
        publisher.publish(String(data="x" * 10_000))
    # Some 10 ms of work; held up by the reader, it would go on when that one's lease ends.
    assert time.monotonic() - began < LEASE_DURATION_S
    process.send(signal.SIGCONT)
    node.destroy_node()
    rclpy.shutdown()


def test_executors_can_be_shut_down_twice(domain: int) -> None:
    rclpy.init(args=[], domain_id=domain)
    executor = SingleThreadedExecutor()
    executor.add_node(Node("n"))
    executor.spin_once(timeout_sec=0.01)
    executor.shutdown()
    executor.shutdown()
    executor.spin_once(timeout_sec=0.01)
    rclpy.shutdown()
