# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests share: a domain of their own, a context, and other processes."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node

PEERS = Path(__file__).parent / "peers.py"
TIMEOUT_S = 20.0  # a safety limit: everything here takes a fraction of a second

# Domains that no other ensemble on this machine uses at the same time; each worker has its own.
_WORKERS = 2
_worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
_domains = itertools.cycle(range(100 + _worker % _WORKERS, 149, _WORKERS))


class Process:
    """Another Python process."""

    def __init__(self, arguments: list[str], environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, *arguments],
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.pid = self._process.pid

    def send(self, number: signal.Signals) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def wait_for_line(self, text: str) -> None:
        """Read its standard output up to a line with this text."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if text in line:
                return
        raise AssertionError(f"ended without {text!r}: {self.finish()}")

    def finish(self) -> tuple[int, str, str]:
        """Wait for its end: exit code, standard output and standard error."""
        out, err = self._process.communicate(timeout=TIMEOUT_S)
        return self._process.returncode, out, err

    def kill(self) -> None:
        """Make sure it is gone."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()


@pytest.fixture
def domain() -> int:
    """A DDS domain of the test's own."""
    return next(_domains)


@pytest.fixture
def run(domain: int) -> Iterator[Callable[..., Process]]:
    """Start a process, by default a peer of tests/peers.py; it is killed in the end."""
    processes: list[Process] = []

    def start(*arguments: str, code: str | None = None, **environment: str) -> Process:
        command = ["-c", code, *arguments] if code is not None else [str(PEERS), *arguments]
        process = Process(command, {"ROS_DOMAIN_ID": str(domain), **environment})
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()


@pytest.fixture
def context(domain: int) -> Iterator[None]:
    """rclpy, started in the test's domain."""
    rclpy.init(args=[], domain_id=domain)
    yield
    rclpy.try_shutdown()


@pytest.fixture
def node(context: None) -> Iterator[Node]:
    """A node."""
    node = Node("tester")
    yield node
    node.destroy_node()


def spin_until(node: Node, condition: Callable[[], bool], timeout_s: float = TIMEOUT_S) -> bool:
    """Spin a node until a condition holds; returns whether it does."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        rclpy.spin_once(node, timeout_sec=0.02)
    return True


def wait_until(condition: Callable[[], bool], timeout_s: float = TIMEOUT_S) -> bool:
    """Wait until a condition holds; returns whether it does."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def complete(node: Node, future: rclpy.Future, timeout_s: float = TIMEOUT_S) -> object:
    """Spin a node until a future is done; returns its result."""
    rclpy.spin_until_future_complete(node, future, timeout_sec=timeout_s)
    assert future.done(), "not done in time"
    return future.result()
