# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tests beside other programs on this host: neither is disturbed, and nothing is left."""

import json
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from ensemble.interfaces import STATE
from ensemble.network import is_embedded
from ensemble.nodes import node_class
from support import leftovers
from support.process_state import wait_until
from support.programs import environment

ROOT = Path(__file__).parents[2]
LIMIT_S = 120.0
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


@contextmanager
def living(domain, *made):
    """Nodes on a DDS domain, in this process, that run until the end."""
    rclpy.init(domain_id=domain)
    executor = SingleThreadedExecutor()
    nodes = [make() for make in made]
    for node in nodes:
        executor.add_node(node)
    thread = Thread(target=executor.spin)
    thread.start()
    try:
        yield nodes
    finally:
        executor.shutdown()
        thread.join()
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown()


TESTS = """
import os, subprocess, sys, time

def test_a_domain(network):
    print(f"domain {network}")

def test_that_leaves_a_process():
    command = [sys.executable, "-c", "import time; time.sleep(1000)"]
    subprocess.Popen(command, start_new_session=True)
    print("left")

def test_that_it_is_gone():
    from support import leftovers
    kept = leftovers.marked(leftovers.RUN, os.environ[leftovers.RUN])
    print("marked", sum(not leftovers.is_zombie(pid) for pid in kept))

def test_that_waits_forever(request):
    if not request.config.getoption("--fault-cases"):
        return
    # Written in one piece, also where Python does not buffer: both write to the same pipe.
    child = "os.setsid(); os.fork(); os.write(1, b'waiting' + bytes([10])); time.sleep(1000)"
    subprocess.Popen([sys.executable, "-c", "import os, time; " + child])
    time.sleep(1000)
"""


@pytest.fixture
def nested(tmp_path):
    """Starts a pytest with this one's conftest and the tests above."""
    (tmp_path / "conftest.py").write_text((ROOT / "test" / "conftest.py").read_text().replace(
        "Path(__file__).parent", f"Path({str(ROOT / 'test')!r})"
    ))  # fmt: skip
    (tmp_path / "test_nested.py").write_text(TESTS)
    # ROS 2 brings plug-ins for versions of pytest that are long past.
    own = {**environment(), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}

    def start(*options):
        return subprocess.Popen(
            [sys.executable, "-m", "pytest", "-s", "-q", "-p", "no:cacheprovider", *options],
            cwd=tmp_path, text=True, stdout=subprocess.PIPE, env=own,
        )  # fmt: skip

    return start


def test_what_a_test_leaves_is_killed_when_it_ends(nested):
    told, _ = nested().communicate(timeout=LIMIT_S)
    assert "left" in told
    assert "marked 0" in told, told


def test_what_tests_have_started_dies_when_pytest_is_killed(nested):
    tests = nested("-k", "forever", "--fault-cases", "1")
    for _ in range(2):  # a process and the one that it has forked say so
        assert any("waiting" in line for line in tests.stdout)
    marked = leftovers.marked(leftovers.RUN, tests.pid)
    assert len(marked) == 2  # in a session of their own, and one whose parent is the other
    tests.send_signal(signal.SIGKILL)
    tests.communicate()
    wait_until(lambda: all(leftovers.is_zombie(pid) for pid in marked))


def test_an_inhabited_domain_is_left_to_who_is_there(nested, tmp_path, network, other_network):
    conftest = tmp_path / "conftest.py"
    text = conftest.read_text().replace("range(2, 60)", f"({network}, {other_network})")
    conftest.write_text(text.replace("slap_ros.tests", "slap_ros.nested"))  # both are claimed here
    with living(network, lambda: rclpy.create_node("neighbour")):
        told, _ = nested("-k", "a_domain").communicate(timeout=LIMIT_S)
    assert f"domain {other_network}" in told


@pytest.mark.slow
@pytest.mark.skipif(not is_embedded(), reason="test/ros has a sourced ROS 2 beside it anyway")
def test_a_run_beside_another_ensemble_on_the_default_domain(network, monkeypatch):
    """The neighbours' simulator stands at the first state of its own first task all the while."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    names = ("sim_node", "perception_node", "planner_node", "skill_server")
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--seed", "3", "--json"]
    command += ["--patience", "10"]  # for a loaded machine
    with living(0, *map(node_class, names)) as (simulator, *_):
        stepped = []
        simulator.create_subscription(STATE.type, STATE.name, stepped.append, STATE.qos)
        run = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
        assert run.returncode == 0, run.stderr
        assert json.loads(run.stdout)["success"]
        assert {state.step for state in stepped} == {0}  # of other runs of this test as well
