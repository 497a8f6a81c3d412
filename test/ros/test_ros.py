# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ensemble on a sourced ROS 2, by the commands of the README."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import cache
from pathlib import Path

import pytest

from ensemble.client import RunClient
from ensemble.interfaces import DOMAIN, JOINT_STATES, MARKERS, PLAN_EVENTS, STATE, TASK
from ensemble.spinner import temporary_node
from slap_ros.bags import evaluate_bag, read_bag, replay_bag
from slap_ros.errors import InvalidParameterError
from support.commands import LIMIT, ros2, solve, started, wait_for_task

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.timeout(300)  # each starts several processes of ROS 2
EXECUTABLES = (
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "acquisition_node",
    "recorder_node",
    "robot_bridge",
    "mock_robot",
)
NODES = EXECUTABLES[:4]
PATIENT = """
/**/mujoco_robot:
  ros__parameters: {pace: 10.0}
/**/robot_bridge:
  ros__parameters: {controller_timeout: 60.0, joint_timeout: 60.0, detection_timeout: 60.0}
"""
PATIENT_AT_A_BENCH = """
/**/servo_bridge:
  ros__parameters: {joint_timeout: 60.0, detection_timeout: 60.0}
"""


def test_the_executables_of_the_page_are_there():
    listed = ros2("pkg", "executables", "slap_ros").split()
    page = (ROOT / "docs" / "ros2.md").read_text()
    for name in (
        *EXECUTABLES,
        "servo_bridge",
        "mujoco_robot",
        "franka_driver",
        "tag_detector",
        "slap",
    ):
        assert name in listed
        assert f"ros2 run slap_ros {name}" in page


@pytest.mark.parametrize(
    ("domain", "options"),
    [
        ("obstacle2d", ["shortcuts:=none"]),
        ("obstacle_tower", []),
        ("stack_at_target", ["skills:=demonstrator"]),
    ],
)
def test_a_launched_ensemble_solves_what_it_is_asked_for(cli, tmp_path, domain, options):
    launch = ["ros2", "launch", "slap_ros", "ensemble.launch.py", f"domain:={domain}", "seed:=1"]
    launch += [f"record:={tmp_path / 'ours'}", "patience:=5.0", *options]
    record = ["ros2", "bag", "record", "--all", "--output", tmp_path / "theirs"]
    with (
        started(record, tmp_path / "record.txt"),
        started(launch, tmp_path / "launch.txt"),
    ):
        plan_length = solve()
        ros2("service", "call", "/slap/close_bag", "std_srvs/srv/Trigger")
    told = (tmp_path / "launch.txt").read_text()
    assert "deprecated" not in told.lower()
    for bag in ("ours", "theirs"):
        found = evaluate_bag(tmp_path / bag)
        assert found.runs[-1].success
        assert found.runs[-1].plan_length == plan_length
        assert replay_bag(tmp_path / bag).identical
    if domain == "obstacle_tower":
        check_playing(tmp_path / "ours")


def test_a_launched_robot_in_mujoco_does_what_it_is_asked_for(cli, tmp_path):
    """A given goal, and a bag whose states are measured: no world repeats them.

    The recorder closes its bag with the launch.
    """
    pytest.importorskip("mujoco")
    patient = tmp_path / "patient.yaml"  # for a loaded machine
    patient.write_text(PATIENT)
    launch = ["ros2", "launch", "slap_ros", "ensemble.launch.py", "domain:=obstacle_tower"]
    launch += ["seed:=1", "world:=mujoco", "goal:=(Holding robot block4)", "shortcuts:=none"]
    launch += [f"record:={tmp_path / 'bag'}", "patience:=5.0", f"params_file:={patient}"]
    with started(launch, tmp_path / "launch.txt"):
        plan_length = solve()
    assert plan_length < 30  # the top block is picked up, no more
    assert evaluate_bag(tmp_path / "bag").runs[-1].plan_length == plan_length
    with pytest.raises(InvalidParameterError, match="its states are measured"):
        replay_bag(tmp_path / "bag")


def test_a_launched_robot_at_a_bench_is_commanded_while_it_moves(cli, tmp_path):
    pytest.importorskip("mujoco")
    patient = tmp_path / "patient.yaml"
    patient.write_text(PATIENT_AT_A_BENCH)
    launch = ["ros2", "launch", "slap_ros", "ensemble.launch.py", "domain:=stack_at_target"]
    launch += ["seed:=300", "world:=mujoco", "servo:=true", "skills:=demonstrator"]
    launch += ["goal:=(Holding cube0)", f"record:={tmp_path / 'bag'}", "patience:=5.0"]
    with started([*launch, f"params_file:={patient}"], tmp_path / "launch.txt"):
        plan_length = solve()
    assert evaluate_bag(tmp_path / "bag").runs[-1].plan_length == plan_length > 20


def check_playing(bag):
    """``ros2 bag play`` reaches whoever listens as our nodes do."""
    heard = []
    topics = (DOMAIN, TASK, STATE, PLAN_EVENTS, MARKERS, JOINT_STATES)
    recorded = [item.type_name for item in read_bag(bag)]
    play = ["ros2", "bag", "play", bag, "--rate", "20"]
    with (
        temporary_node(lambda: RunClient(lambda name, _: heard.append(name), topics)) as (
            _,
            spinner,
        ),
        started(play, bag.parent / "play.txt"),
    ):
        for topic in topics:
            wanted = recorded.count(topic.type_name)
            assert wanted
            assert spinner.spin_until(lambda: heard.count(topic.type_name) >= wanted, LIMIT), topic  # noqa: B023


@pytest.mark.parametrize("embedded_nodes", [NODES[:2], NODES[2:]], ids=["world", "solver"])
def test_embedded_and_real_nodes_solve_a_task_together(
    cli, tmp_path, embedded, real, embedded_nodes
):
    with ExitStack() as stack:
        for name in NODES:
            command, environment = embedded if name in embedded_nodes else real
            output = tmp_path / f"{name}.txt"
            options = ["-p", "patience:=5.0"] if name != "sim_node" else []
            options += ["-p", "shortcuts:=none"] if name in ("planner_node", "skill_server") else []
            call = [*command, name, "--ros-args", *options]
            stack.enter_context(started(call, output, **environment))
        assert solve() > 0
        assert set(ros2("node", "list").split()) >= {f"/{name}" for name in NODES}


def test_a_terminal_at_the_default_range_finds_an_embedded_node_soon(cli, tmp_path, embedded):
    """Long before CycloneDDS itself would announce it again, after 30 s."""
    command, environment = embedded
    look = (
        "import rclpy, sys, time; rclpy.init(); node = rclpy.create_node('looker')\n"
        "end = time.monotonic() + 15.0\n"
        "while '/slap/state' not in dict(node.get_topic_names_and_types()):\n"
        "    rclpy.spin_once(node, timeout_sec=0.05)\n"
        "    if time.monotonic() > end: sys.exit('not found')\n"
    )
    with started([*command, "sim_node"], tmp_path / "sim_node.txt", **environment):
        wait_for_task()
        env = os.environ | {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
        subprocess.run([sys.executable, "-c", look], env=env, check=True, timeout=LIMIT)


def test_the_range_is_hinted_at_once(cli, monkeypatch, tmp_path):
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE")
    launch = ["ros2", "launch", "slap_ros", "ensemble.launch.py"]
    with started(launch, tmp_path / "launch.txt"):
        wait_for_task(ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    told = (tmp_path / "launch.txt").read_text()
    assert told.count("export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST") == 1


WRONG = [
    ({"ROS_DOMAIN_ID": "abc"}, "abc"),
    ({"ROS_DOMAIN_ID": "1000"}, "1000"),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "EVERYWHERE"}, "EVERYWHERE"),
    (
        {
            "ROS_SECURITY_ENABLE": "true",
            "ROS_SECURITY_STRATEGY": "Enforce",
            "ROS_SECURITY_KEYSTORE": "/nowhere",
        },
        "/nowhere",
    ),
]


@pytest.mark.parametrize(("wrong", "words"), WRONG, ids=["abc", "1000", "range", "keystore"])
def test_a_wrong_environment_is_an_error_and_no_traceback(network, wrong, words):
    run = ["ros2", "run", "slap_ros"]
    environment = os.environ | wrong
    options = {"env": environment, "capture_output": True, "text": True, "timeout": LIMIT}
    node = subprocess.run([*run, "sim_node"], **options)
    assert node.returncode == 15, node.stderr
    assert words in node.stderr
    assert "Traceback" not in node.stderr
    doctor = subprocess.run([*run, "slap", "doctor", "--json"], **options)
    assert "Traceback" not in doctor.stderr  # `ros2 run` adds a line to what slap prints
    checks = {check["name"]: check for check in json.loads(doctor.stdout.splitlines()[0])}
    for name in ("ROS 2 settings", "DDS between two processes"):
        assert checks[name]["status"] == "problem"
        assert words in checks[name]["found"]


# What rclpy itself prints where the signal comes while it makes a task, of which there is no more.
HALF_MADE_TASK = re.compile(
    r"Traceback \(most recent call last\):\n  File \"\S*rclpy/task\.py\", line \d+, in __del__\n"
    r".*?has no attribute '_exception'\n",
    re.DOTALL,
)


@cache
def installed_prefix():
    """Where the package is installed; ``ros2`` takes a second to say it."""
    return ros2("pkg", "prefix", "slap_ros").strip()


@pytest.mark.parametrize("name", EXECUTABLES)
def test_ctrl_c_is_quiet_from_the_start(network, tmp_path, name):
    options = ["-p", f"bag:={tmp_path / 'bag'}"] if name == "recorder_node" else []
    options += ["-p", "domain:=obstacle_tower"] if name in ("robot_bridge", "mock_robot") else []
    executable = installed_prefix()
    for delay_s in (0.0, 0.2, 0.4, 0.7, 1.2):
        node = subprocess.Popen(
            [f"{executable}/lib/slap_ros/{name}", "--ros-args", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        # Before that Python itself starts, in whose first 0.1 s nobody can keep it quiet.
        while "numpy" not in Path(f"/proc/{node.pid}/maps").read_text():
            time.sleep(0.001)
        time.sleep(delay_s)
        node.send_signal(signal.SIGINT)
        told, _ = node.communicate(timeout=LIMIT)
        assert "Traceback" not in HALF_MADE_TASK.sub("", told), (delay_s, told)
        assert node.returncode == 0, (delay_s, told)
