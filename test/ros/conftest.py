# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""For tests that need a sourced ROS 2, and nodes of either kind."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ensemble.network import is_embedded

ROOT = Path(__file__).parents[2]
# Without a ROS 2 there is nothing to test here: `make test-ros` says what is missing.
collect_ignore_glob = ["test_*.py"] if is_embedded() or not shutil.which("ros2") else []


@pytest.fixture
def cli(network, monkeypatch):
    """A terminal as the README leaves it, whose daemon ends with it."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    yield network
    subprocess.run(["ros2", "daemon", "stop"], check=True, capture_output=True)


@pytest.fixture
def embedded():
    """The command that runs embedded nodes, and their environment."""
    python = Path(os.environ.get("EMBEDDED_PYTHON", ROOT / ".venv/bin/python"))
    if not python.exists():
        pytest.skip("no Python with embedded_ros: make install")
    path = os.pathsep.join([str(ROOT), str(ROOT / "embedded_ros" / "src")])
    return [python, "-m"], {"PYTHONPATH": path, "AMENT_PREFIX_PATH": ""}


@pytest.fixture
def real():
    """The command that runs nodes on ROS 2's rclpy, and their environment."""
    return [sys.executable, "-m"], {}
