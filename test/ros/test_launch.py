# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the launch file's arguments, a user's parameter file and the shipped one say, in order."""

import os
import shutil
import signal
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

from support.commands import LIMIT, parameter, started, wait_for_task

pytestmark = pytest.mark.timeout(300)  # each starts several processes of ROS 2
LAUNCH = ["ros2", "launch", "slap_ros", "ensemble.launch.py"]


def written(path, **nodes):
    whole = {f"/**/{name}": {"ros__parameters": values} for name, values in nodes.items()}
    path.write_text(yaml.safe_dump(whole))
    return path


def test_a_parameter_file_goes_before_defaults_and_arguments_before_the_file(cli, tmp_path):
    file = written(
        tmp_path / "mine.yaml",
        sim_node={"domain": "obstacle2d", "seed": 7, "index": 1, "visualize": False},
        planner_node={"planner": "astar", "samples": 3},
        skill_server={"state_timeout": 3.5},
    )
    launch = [*LAUNCH, f"params_file:={file}", "index:=2", "patience:=5.0"]
    with started(launch, tmp_path / "launch.txt"):
        wait_for_task()
        assert (parameter("sim_node", "seed"), parameter("sim_node", "index")) == ("7", "2")
        assert parameter("sim_node", "visualize") == "False"
        assert (parameter("planner_node", "planner"), parameter("planner_node", "samples")) == (
            "astar",
            "3",
        )
        assert parameter("planner_node", "patience") == "5.0"
        assert parameter("skill_server", "state_timeout") == "3.5"
        assert parameter("skill_server", "samples") == "16"


@pytest.mark.parametrize(
    ("argument", "words"),
    [
        ("params_file:=nowhere.yaml", "nowhere.yaml"),
        ("world:=moon", "moon"),
        ("camera:=perhaps", "perhaps"),
        ("acquisition:=perhaps", "perhaps"),
        ("servo:=perhaps", "perhaps"),
        ("rviz:=perhaps", "perhaps"),
        ("seed:=x", "seed must be a whole number"),
    ],
)
def test_a_wrong_argument_starts_nothing(cli, argument, words):
    done = subprocess.run([*LAUNCH, argument], capture_output=True, text=True, timeout=LIMIT)
    assert done.returncode != 0
    assert words in done.stdout + done.stderr
    assert "process started" not in done.stdout + done.stderr


@pytest.mark.parametrize("cause", ["killed", "refused"])
def test_a_launch_says_that_its_recorder_has_ended_and_goes_on(cli, tmp_path, cause):
    bag, output = tmp_path / "bag", tmp_path / "launch.txt"
    if cause == "refused":
        bag.mkdir()
    with started([*LAUNCH, "domain:=obstacle2d", f"record:={bag}"], output) as launch:
        wait_for_task()
        if cause == "killed":
            os.kill(process_of(launch, "recorder_node"), signal.SIGKILL)
        wait_for_line(output, "NOTHING IS RECORDED from now on")
        assert parameter("sim_node", "domain") == "obstacle2d"


def test_a_recorder_that_ends_with_its_launch_is_not_missed(cli, tmp_path):
    output = tmp_path / "launch.txt"
    with started([*LAUNCH, "domain:=obstacle2d", f"record:={tmp_path / 'bag'}"], output):
        wait_for_task()
    assert "NOTHING IS RECORDED" not in output.read_text()


def process_of(launch, name):
    """The number of the process of a node that a launch has started."""
    children = Path(f"/proc/{launch.pid}/task/{launch.pid}/children").read_text().split()
    (found,) = (c for c in children if name in Path(f"/proc/{c}/cmdline").read_text())
    return int(found)


def wait_for_line(output, words):
    """Return once a process has written these words."""
    end = time.monotonic() + LIMIT
    while words not in output.read_text():
        assert time.monotonic() < end, output.read_text()
        time.sleep(0.1)


@pytest.mark.skipif(shutil.which("rviz2") is not None, reason="RViz is installed")
def test_without_rviz_nothing_is_left_behind(cli):
    done = subprocess.run([*LAUNCH, "rviz:=true"], capture_output=True, text=True, timeout=LIMIT)
    assert done.returncode != 0
    assert "'rviz2' not found" in done.stdout + done.stderr
    assert "process started" not in done.stdout + done.stderr


def test_on_a_robot_a_skill_waits_longer_for_a_state(cli, tmp_path):
    launch = [*LAUNCH, "world:=mock", "domain:=obstacle_tower"]
    with started(launch, tmp_path / "launch.txt"):
        wait_for_task()
        assert parameter("skill_server", "state_timeout") == "8.0"
        assert (
            parameter("mock_robot", "domain")
            == parameter("planner_node", "domain")
            == "obstacle_tower"
        )


def test_a_simulated_fr3_is_launched_or_says_what_is_not_installed(cli, tmp_path):
    output = tmp_path / "launch.txt"
    launch = [*LAUNCH, "world:=franka-sim", "domain:=obstacle_tower", "speed:=0.2"]
    with started(launch, output):
        if find_spec("franky") is None or find_spec("franky_sim") is None:
            wait_for_line(output, "[franka_driver-2]: process has died")
            assert "is not installed: " in output.read_text()
            return
        wait_for_task()  # which robot_bridge publishes once it has measured arm and objects
        assert parameter("robot_bridge", "arm") == "fr3"
        assert parameter("franka_driver", "simulated") == "True"
        assert parameter("robot_bridge", "speed") == parameter("franka_driver", "speed") == "0.2"
        assert parameter("skill_server", "state_timeout") == "68.0"
