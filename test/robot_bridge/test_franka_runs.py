# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs and recordings on a Franka arm, real or simulated, through the nodes and commands."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from ensemble.nodes import RunSettings, node_parameters
from ensemble.robot_parameters import parse_franka
from robot_bridge.franka.objects import ModelledObjects
from slap_ros.api.execution import execute
from slap_ros.api.planning import plan
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import (
    ErrorCode,
    InvalidParameterError,
)
from slap_ros.robot.blending import ORDERS
from slap_ros.robot.franka.arm import ArmReading
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.joint_space.features import ROBOT
from support.franka_wheels import require_franky, require_simulated_fr3
from support.slap_command import slap


@pytest.fixture(scope="module")
def run():
    """A block of the tower is grasped."""
    domain = get_domain("obstacle_tower")
    task = task_with_goal(domain, 1, 0, "(Holding robot block4)")
    found = execute(domain, task, plan(domain, task, None))
    assert found.success
    return found


@pytest.fixture(scope="module")
def bag(run, tmp_path_factory):
    return run.bag(tmp_path_factory.mktemp("franka") / "bag")


def test_modelled_objects_are_not_pushed_by_an_arm_that_is_looked_at_late(run):
    """The whole way to a block is read before a control period of the model has passed."""

    def reading(state):
        (robot,) = state.layout.of_type(ROBOT)
        joints = tuple(float(state.get(robot, f.name)) for f in JOINT_FEATURES)
        return ArmReading(0.0, 0.0, joints, (0.0,) * 7, 0.08, False)

    first, *way, grasped = run.states
    arm = SimpleNamespace(reading=reading(first), on_reading=None)
    objects = ModelledObjects(run.domain, first, arm)
    before = objects.poses()
    for state in way:
        arm.reading = reading(state)
        arm.on_reading(arm.reading)
    (robot,) = grasped.layout.of_type(ROBOT)
    assert objects.grip(0.0) == pytest.approx(2.0 * grasped.get(robot, "finger"), abs=1e-4)
    for name, pose in objects.poses().items():
        np.testing.assert_allclose(pose.position, before[name].position, atol=1e-6)


def replayed(bag, *options):
    command = [sys.executable, "-m", "ensemble.cli", "bag", "replay", str(bag), *options]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=200)
    return ran.returncode, ran.stdout, " ".join(ran.stderr.split())


@pytest.mark.slow
@pytest.mark.timeout(240)  # two processes import what they need, and one of them the simulation
def test_a_recording_is_replayed_on_it_without_stops(network, bag):
    require_simulated_fr3()
    code, out, told = replayed(bag, "--to", "franka-sim", "--robot", "speed=1.0", "--json")
    assert code == 0, told
    data = json.loads(out)
    assert data["played"] == data["steps"] == 15
    assert [e["quantity"].split()[0] for e in data["extremes"]][2:5] == list(ORDERS)


@pytest.mark.slow  # all nodes, each in a process of its own, and the simulation
@pytest.mark.timeout(300)
def test_a_task_is_solved_on_it_in_closed_loop(network):
    require_simulated_fr3()
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle_tower", "--seed", "1"]
    command += ["--goal", "(Holding robot block4)", "--shortcuts", "none", "--json"]
    command += ["--world", "franka-sim", "--robot", "horizon=3,speed=1.0"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert ran.returncode == 0, ran.stderr
    data = json.loads(ran.stdout)
    assert data["success"]
    assert data["plan_length"] == 15


def test_no_arm_moves_without_a_yes_and_a_dry_run_needs_no_robot(bag):
    require_franky()
    for command in (
        ["bag", "replay", str(bag), "--to", "franka"],
        ["run", "obstacle_tower", "--world", "franka"],
    ):
        asked = slap(*command, "--robot", "ip=127.78.0.3")
        assert asked.exit_code == ErrorCode.GOAL_CANCELED
        assert "nothing moved" in asked.stderr
        assert slap(*command).exit_code == ErrorCode.INVALID_PARAMETER
    dry = slap("bag", "replay", bag, "--to", "franka", "--dry-run")
    assert dry.exit_code == 0, dry.stderr
    assert "jerk" in dry.stdout


def test_parameters_reach_the_bridge_and_the_driver():
    bridge, driver = parse_franka("ip=172.16.0.2,scene=lab.yaml,speed=0.1,collision_force=15")
    assert bridge == {"scene": "lab.yaml", "speed": 0.1}
    assert driver == {"ip": "172.16.0.2", "speed": 0.1, "collision_force": 15.0}
    chosen = RunSettings(
        DomainChoice("obstacle_tower", "fair"),
        1,
        0,
        "lazy",
        None,
        world="franka",
        bridge=bridge,
        franka=driver,
    )
    nodes = node_parameters(chosen)
    assert nodes["robot_bridge"]["arm"] == "fr3"
    assert nodes["robot_bridge.franka"]["ip"] == "172.16.0.2"
    assert "simulated" not in nodes["robot_bridge.franka"]
    with pytest.raises(InvalidParameterError, match="no parameter 'address'"):
        parse_franka("address=172.16.0.2")
