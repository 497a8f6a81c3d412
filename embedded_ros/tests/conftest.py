# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests share: a domain of their own, a context, and other processes."""

from __future__ import annotations

import ctypes
import itertools
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node

PEERS = Path(__file__).parent / "peers.py"
# A safety limit: everything here takes a fraction of a second, but a loaded machine takes its time.
TIMEOUT_S = 60.0

# Below the ports that the kernel gives to anybody.
_DOMAINS = range(60, 101)
_next_domains = itertools.cycle(_DOMAINS)


_LIBC = ctypes.CDLL(None)  # opened here: between fork and exec nothing may be loaded
_PR_SET_PDEATHSIG = 1  # <sys/prctl.h>


def pytest_configure() -> None:
    """Let Ctrl-C end what tests start, also where pytest runs in a shell's background."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _die_with_parent() -> None:
    """Let a process end when pytest does, by SIGKILL too."""
    if sys.platform == "linux":
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


class Process:
    """Another Python process."""

    def __init__(self, arguments: list[str], environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, *arguments],
            env={**os.environ, **environment},
            # Not inherited: under pytest that is /dev/null, and reading it ends at once.
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=_die_with_parent,
        )
        self.pid = self._process.pid

    def send(self, number: signal.Signals) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def tell(self, line: str) -> None:
        """Write a line to its standard input."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

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
        """Make sure it is gone; pytest shows what it wrote, and how it ended, of a failed test."""
        code = self._process.poll()
        if code is None:
            self._process.kill()
        out, err = self._process.communicate()
        how = "still ran" if code is None else f"had ended with exit code {code}"
        print(f"process {self.pid} {how}\n{out}{err}")


@contextmanager
def claimed_domain() -> Iterator[int]:
    """A DDS domain that no other worker, and no other run of these tests, uses meanwhile."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        candidates = itertools.islice(_next_domains, len(_DOMAINS))
        number = next((number for number in candidates if _claims(claim, number)), None)
        assert number is not None, "every domain is in use"
        yield number


def _claims(claim: socket.socket, number: int) -> bool:
    # Sockets of other programs, whose DDS domain N has 250 UDP ports from 7400 + 250 N on.
    first = 7400 + 250 * number
    rows = Path("/proc/net/udp").read_text().split("\n")[1:] if sys.platform == "linux" else []
    ports = [int(row.split()[1].rpartition(":")[2], 16) for row in rows if row]
    if any(first <= port < first + 250 for port in ports):
        return False
    # An abstract address: gone with its process, and shared by whoever shares the loopback.
    try:
        claim.bind(f"\0embedded_ros.tests.domain.{number}")
    except OSError:
        return False
    return True


@pytest.fixture
def domain() -> Iterator[int]:
    """A DDS domain of the test's own."""
    with claimed_domain() as number:
        yield number


@pytest.fixture
def other_domain() -> Iterator[int]:
    """A second one."""
    with claimed_domain() as number:
        yield number


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
