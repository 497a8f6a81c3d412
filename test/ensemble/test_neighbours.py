# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tests beside other programs on this host: neither is disturbed, and nothing is left."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import leftovers
import pytest

from ensemble.network import is_embedded

ROOT = Path(__file__).parents[2]
LIMIT_S = 60.0
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


def wait_until(condition):
    end = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def node(name, **environment):
    command = [sys.executable, "-m", name, "--ros-args", "--log-level", "error"]
    return subprocess.Popen(command, env={**os.environ, **environment})


def inhabited(domain):
    first = 7400 + 250 * domain
    rows = Path("/proc/net/udp").read_text().split("\n")[1:]
    ports = [int(row.split()[1].rpartition(":")[2], 16) for row in rows if row]
    return any(first <= port < first + 250 for port in ports)


TESTS = """
import os, subprocess, sys, time

def test_a_domain(network):
    print(f"domain {network}")

def test_that_leaves_a_process():
    command = [sys.executable, "-c", "import time; time.sleep(1000)"]
    subprocess.Popen(command, start_new_session=True)
    print("left")

def test_that_it_is_gone():
    import leftovers
    kept = leftovers.marked(leftovers.RUN, os.environ[leftovers.RUN])
    print("marked", sum(not leftovers.is_zombie(pid) for pid in kept))

def test_that_waits_forever(request):
    if not request.config.getoption("--fault-cases"):
        return
    child = "import os, time; os.setsid(); os.fork(); time.sleep(1000)"
    subprocess.Popen([sys.executable, "-c", child])
    time.sleep(1)
    print("waiting", flush=True)
    time.sleep(1000)
"""


@pytest.fixture
def nested(tmp_path):
    """Starts a pytest with this one's conftest and the tests above."""
    (tmp_path / "conftest.py").write_text((ROOT / "test" / "conftest.py").read_text().replace(
        "Path(__file__).parent", f"Path({str(ROOT / 'test')!r})"
    ))  # fmt: skip
    (tmp_path / "test_nested.py").write_text(TESTS)

    def start(*options, **environment):
        return subprocess.Popen(
            [sys.executable, "-m", "pytest", "-s", "-q", "-p", "no:cacheprovider", *options],
            cwd=tmp_path, text=True, stdout=subprocess.PIPE, env={**os.environ, **environment},
        )  # fmt: skip

    return start


def test_what_a_test_leaves_is_killed_when_it_ends(nested):
    told, _ = nested().communicate(timeout=LIMIT_S)
    assert "left" in told
    assert "marked 0" in told, told


def test_what_tests_have_started_dies_when_pytest_is_killed(nested):
    tests = nested("-k", "forever", "--fault-cases", "1")
    wait_until(lambda: "waiting" in tests.stdout.readline())
    marked = leftovers.marked(leftovers.RUN, tests.pid)
    assert len(marked) == 2  # in a session of their own, and one whose parent is the other
    tests.send_signal(signal.SIGKILL)
    tests.communicate()
    wait_until(lambda: all(leftovers.is_zombie(pid) for pid in marked))


def test_an_inhabited_domain_is_left_to_who_is_there(nested):
    neighbours = [node("sim_node", ROS_DOMAIN_ID=str(number)) for number in (150, 151)]
    wait_until(lambda: all(map(inhabited, (150, 151))))
    told, _ = nested("-k", "a_domain").communicate(timeout=LIMIT_S)
    (domain,) = [int(line.split()[1]) for line in told.split("\n") if line.startswith("domain")]
    assert domain not in (150, 151)
    for neighbour in neighbours:
        assert neighbour.poll() is None
        neighbour.kill()
        neighbour.wait()


@pytest.mark.skipif(not is_embedded(), reason="test/ros has a sourced ROS 2 beside it anyway")
def test_a_run_beside_another_ensemble_on_the_default_domain(network):
    """The neighbours' simulator stands at the first state of its own first task all the while."""
    names = ("sim_node", "perception_node", "planner_node", "skill_server")
    environment = {"ROS_DOMAIN_ID": "", "ROS_AUTOMATIC_DISCOVERY_RANGE": ""}
    neighbours = [node(name, **environment) for name in names]
    wait_until(lambda: inhabited(0))
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--seed", "3", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["success"]
    assert all(neighbour.poll() is None for neighbour in neighbours)
    for neighbour in neighbours:
        neighbour.kill()
        neighbour.wait()
