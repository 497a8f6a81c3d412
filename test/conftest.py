# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every test that opens a network gets a DDS domain of its own."""

import itertools
import os

import pytest

# Apart from those of embedded_ros' own tests, and within what UDP ports allow. Each worker has
# its own.
WORKERS = 2
WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
DOMAIN_IDS = itertools.cycle(range(150 + WORKER % WORKERS, 200, WORKERS))


@pytest.fixture
def network(monkeypatch):
    """A DDS domain that nobody else uses; its id."""
    number = next(DOMAIN_IDS)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    assert os.environ["ROS_DOMAIN_ID"] == str(number)
    return number
