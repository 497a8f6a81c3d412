# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every test that opens a network gets a DDS domain of its own."""

import itertools
import socket
from contextlib import contextmanager

import pytest

# Apart from those of embedded_ros' own tests, and within what UDP ports allow.
DOMAIN_IDS = range(150, 200)
_next_ids = itertools.cycle(DOMAIN_IDS)


def pytest_addoption(parser):
    parser.addoption(
        "--fault-cases",
        type=int,
        default=0,
        help="how many cases of each kind of fault to inject; by default a few",
    )


@pytest.fixture
def network(monkeypatch):
    """A DDS domain that no other worker, and no other run of these tests, uses meanwhile."""
    with _domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "CYCLONEDDS_URI"):
            monkeypatch.setenv(name, "")  # so that it is put back as it was
            monkeypatch.delenv(name)
        yield number


@pytest.fixture
def other_network():
    """One more."""
    with _domain() as number:
        yield number


@contextmanager
def _domain():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        candidates = itertools.islice(_next_ids, len(DOMAIN_IDS))
        number = next((number for number in candidates if _claims(claim, number)), None)
        assert number is not None, "every domain is in use"
        yield number


def _claims(claim, number):
    # An abstract address: gone with its process, and shared by whoever shares the loopback.
    try:
        claim.bind(f"\0slap_ros.tests.domain.{number}")
    except OSError:
        return False
    return True
