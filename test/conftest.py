# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every test that opens a network gets a DDS domain of its own; what it starts ends with it."""

import gc
import itertools
import os
import signal
import socket
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from rclpy.logging import LoggingSeverity, set_logger_level

from support import leftovers

HERE = Path(__file__).parent
# Apart from those of embedded_ros' own tests, and below the ports that the kernel gives to anybody.
DOMAIN_IDS = range(2, 60)
_next_ids = itertools.cycle(DOMAIN_IDS)
_numbers = itertools.count()
# Marks of tests by their fixtures. No test opens a network without one: see `no_network`.
MARKED_BY = {
    "ensemble": {"network", "other_network", "module_network"},
    "browser": {"browser"},
    "training": {"trained"},
}
PORTS = 250  # UDP ports of a DDS domain, domain 0 from 7400 on


def pytest_addoption(parser):
    parser.addoption(
        "--fault-cases",
        type=int,
        default=0,
        help="how many cases of each kind of fault to inject; by default a few",
    )


def pytest_configure(config):
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        # As in a shell's background. Whatever tests start would inherit it and ignore Ctrl-C.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform == "linux":
        config.guard = leftovers.start_guard()


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    # Those that build the site and the wheels, beside this file, take longest. In their turn they
    # would come last, and processors would wait for them.
    items.sort(key=lambda item: item.path.parent != HERE)
    for item in items:
        for mark, fixtures in MARKED_BY.items():
            if fixtures & set(getattr(item, "fixturenames", ())):
                item.add_marker(mark)


def pytest_collection(session):
    gc.disable()  # tests stay as long as the process does


def pytest_collection_finish(session):
    """Garbage is looked for among what tests make, and no longer in 5,000 tests and all modules."""
    gc.freeze()
    gc.set_threshold(10_000)  # objects; by default 700, for which planning takes a tenth longer
    gc.enable()


@pytest.fixture(autouse=True)
def nothing_is_left(monkeypatch):
    """Whatever a test starts ends with it, also where it failed."""
    if sys.platform != "linux":
        yield
        return
    mark, newest = f"{os.getpid()}-{next(_numbers)}", leftovers.newest_pid()
    monkeypatch.setenv(leftovers.TEST, mark)
    yield
    leftovers.kill_marked(leftovers.TEST, mark, newest)


@pytest.fixture(autouse=True)
def no_network(monkeypatch):
    """A test that opens a network without the fixture fails, rather than meet another one there."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "none: this test lacks the fixture network")


@pytest.fixture
def network(monkeypatch):
    """A DDS domain that no other worker, and no other run of these tests, uses meanwhile."""
    with _domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "CYCLONEDDS_URI"):
            monkeypatch.setenv(name, "")  # so that it is put back as it was
            monkeypatch.delenv(name)
        # What an earlier test set by --log-level outlives its context, in ROS 2 as well.
        set_logger_level("", LoggingSeverity.INFO)
        yield number


@pytest.fixture
def other_network():
    """One more."""
    with _domain() as number:
        yield number


@pytest.fixture(scope="module")
def module_network():
    """One for what several tests of a module share; not set in the environment."""
    with _domain() as number:
        yield number


@pytest.fixture(scope="session")
def script():
    """A run of one episode of Obstacle 2D. Shared: not to be changed."""
    from support.truthful_run import Script  # imports the core, which most tests do not need here

    script = Script(seed=7)
    script.run()
    return script


@contextmanager
def _domain():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        candidates = itertools.islice(_next_ids, len(DOMAIN_IDS))
        number = next((number for number in candidates if _claims(claim, number)), None)
        assert number is not None, "every domain is in use"
        yield number


def _claims(claim, number):
    # An abstract address: gone with its process, and shared by whoever shares the loopback.
    # It does not tell of other programs, but the kernel does of their sockets.
    if is_inhabited(number):
        return False
    try:
        claim.bind(f"\0slap_ros.tests.domain.{number}")
    except OSError:
        return False
    return True


def is_inhabited(number):
    """Whether a program on this host has a UDP port of a DDS domain."""
    first = 7400 + PORTS * number
    tables = (Path("/proc/net/udp"), Path("/proc/net/udp6"))
    rows = [row for table in tables if table.exists() for row in table.read_text().split("\n")[1:]]
    ports = [int(row.split()[1].rpartition(":")[2], 16) for row in rows if row]
    return any(first <= port < first + PORTS for port in ports)
