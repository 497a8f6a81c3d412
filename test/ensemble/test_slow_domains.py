# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain that takes seconds to import and to step: waited for, and never in a callback."""

import json
import subprocess
import sys

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from slap_msgs.msg import DomainInfo

from ensemble.interfaces import ATOMS, DOMAIN
from ensemble.spinner import Spinner
from perception_node.node import PerceptionNode

LIMIT = 120.0  # s, far more than anything here takes
SLOW = '''
import os, sys, threading, time
from pathlib import Path
from dataclasses import replace
from slap_ros.domains import get_domain

IMPORTED_IN = threading.current_thread().name
if "SLOW_UNTIL" in os.environ:
    while not Path(os.environ["SLOW_UNTIL"]).exists():
        time.sleep(0.02)
else:
    time.sleep(2.0)
IN_SIMULATOR = "sim_node" in sys.argv[0]


class SlowWorld:
    """Obstacle 2D, which in the simulator takes longer for a step than a skill waits for one."""

    def __init__(self, world):
        self._world, self._slow = world, IN_SIMULATOR

    def step(self, action):
        if self._slow:
            time.sleep(3.0)
            self._slow = False
        return self._world.step(action)

    def __getattr__(self, name):
        return getattr(self._world, name)


def make():
    made = get_domain("obstacle2d")
    world = lambda state: SlowWorld(made.make_world(state))
    return replace(made, name="slow", preset="default", make_world=world)
'''


@pytest.fixture
def slow_domain(install_domain):
    return install_domain("slow", SLOW)


@pytest.mark.slow
def test_a_slow_domain_is_waited_for(network, slow_domain):
    done = subprocess.run(
        [sys.executable, "-m", "ensemble.cli", "run", slow_domain, "--seed", "3",
         "--patience", "20", "--shortcuts", "none", "--json"],
        capture_output=True,
        text=True,
        timeout=4 * LIMIT,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["success"]


def test_what_the_simulator_announces_is_imported_in_a_thread(
    network, slow_domain, tmp_path, monkeypatch
):
    go_on = tmp_path / "go on"
    monkeypatch.setenv("SLOW_UNTIL", str(go_on))
    rclpy.init()
    executor, source = SingleThreadedExecutor(), rclpy.create_node("source")
    node = PerceptionNode()
    try:
        for each in (node, source):
            executor.add_node(each)
        publisher = source.create_publisher(DOMAIN.type, DOMAIN.name, DOMAIN.qos)
        publisher.publish(DomainInfo(name=slow_domain))
        spinner = Spinner(executor)
        assert spinner.spin_until(
            lambda: hasattr(sys.modules.get("slow_domain"), "IMPORTED_IN"), LIMIT
        )
        assert sys.modules["slow_domain"].IMPORTED_IN.startswith("episode")
        # Callbacks run meanwhile: the import is not over yet.
        assert not hasattr(sys.modules["slow_domain"], "make")
        go_on.touch()
        assert spinner.spin_until(lambda: hasattr(sys.modules["slow_domain"], "make"), LIMIT)
    finally:
        go_on.touch()
        node.destroy_node()
        source.destroy_node()
        executor.shutdown()
        rclpy.shutdown()


def test_what_is_named_is_imported_before_anybody_sees_the_node(network, slow_domain):
    rclpy.init()
    try:
        node = PerceptionNode(parameter_overrides=[Parameter("domain", value=slow_domain)])
        assert sys.modules["slow_domain"].IMPORTED_IN == "MainThread"
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        spinner = Spinner(executor)  # rclpy counts a moment later
        assert spinner.spin_until(lambda: node.count_publishers(ATOMS.name) == 1, LIMIT)
        node.destroy_node()
        executor.shutdown()
    finally:
        rclpy.shutdown()
