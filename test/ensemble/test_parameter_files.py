# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameter files that ship: what they set is there, and a copy of the first hides no other."""

import re
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from ensemble.acquisition_parameters import AcquisitionParameters
from ensemble.camera_parameters import TagDetectorParameters
from ensemble.common_parameters import CommonParameters
from ensemble.nodes import BEFORE_FRANKA_SIM, RunSettings, node_parameters
from ensemble.parameters import OF_ENSEMBLE
from ensemble.perception_parameters import PerceptionParameters
from ensemble.robot_parameters import (
    FrankaDriverParameters,
    MockRobotParameters,
    MujocoRobotParameters,
    RobotBridgeParameters,
    ServoBridgeParameters,
)
from ensemble.world_parameters import WorldParameters
from planner_node.node import PlannerParameters
from recorder_node.node import RecorderParameters
from sim_node.node import SimParameters
from skill_server.node import SkillServerParameters
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.worlds.contact.hand_model import HandModel

CONFIG = Path(__file__).parents[2] / "config"
FILES = sorted(path.name for path in CONFIG.glob("*.yaml"))
KINDS = {
    "sim_node": (SimParameters,),
    "robot_bridge": (RobotBridgeParameters,),
    "servo_bridge": (ServoBridgeParameters,),
    "mock_robot": (MockRobotParameters,),
    "mujoco_robot": (MujocoRobotParameters,),
    "franka_driver": (FrankaDriverParameters,),
    "tag_detector": (TagDetectorParameters,),
    "perception_node": (PerceptionParameters, CommonParameters),
    "skill_server": (SkillServerParameters, CommonParameters),
    "planner_node": (PlannerParameters, CommonParameters),
    "acquisition_node": (AcquisitionParameters, CommonParameters),
    "recorder_node": (RecorderParameters,),
}
CHOSEN = DomainChoice("obstacle_tower", "fair")


def blocks(name, *, with_comments=False):
    """Parameters of each node in a file, those in comments too if asked for."""
    text = (CONFIG / name).read_text()
    if with_comments:
        text = re.sub(r"^    # (?=\w+: )", "    ", text, flags=re.M)
    whole = yaml.safe_load(text)
    return {node.removeprefix("/**/"): block["ros__parameters"] for node, block in whole.items()}


def defaults_of(node):
    return {item.name: item.default for kind in KINDS[node] for item in fields(kind)}


def as_default(value):
    return tuple(value) if isinstance(value, list) else value


@pytest.mark.parametrize("name", FILES)
def test_every_parameter_that_a_file_sets_is_one_of_its_node_and_of_its_type(name):
    for node, values in blocks(name, with_comments=True).items():
        defaults = defaults_of(node)
        for key, value in values.items():
            assert key in defaults, (node, key)
            assert type(as_default(value)) is type(as_default(defaults[key])), (node, key)


def test_a_block_for_all_nodes_may_set_what_the_ensemble_is_about():
    about = {item.name for kind in (CommonParameters, WorldParameters) for item in fields(kind)}
    assert set(OF_ENSEMBLE) == about


def test_the_file_of_all_nodes_has_their_defaults():
    found = blocks("ensemble.yaml", with_comments=True)
    assert set(found) == set(KINDS)
    for node, values in found.items():
        defaults = defaults_of(node)
        wrong = {key: value for key, value in values.items() if as_default(value) != defaults[key]}
        assert not wrong, node


@pytest.mark.parametrize("name", [name for name in FILES if name != "ensemble.yaml"])
def test_a_copy_of_the_file_of_all_nodes_leaves_what_a_world_sets(name):
    """A copy goes before the world's file, so it must not say the same parameters again."""
    everywhere = blocks("ensemble.yaml")
    for node, values in blocks(name).items():
        assert not set(values) & set(everywhere[node]), node


def test_a_launched_simulated_fr3_has_the_parameters_of_a_started_one():
    started = node_parameters(RunSettings(CHOSEN, 1, 0, "lazy", None, world="franka-sim"))
    launched = blocks("franka.yaml")["robot_bridge"] | blocks("franka-sim.yaml")["robot_bridge"]
    assert {key: as_default(value) for key, value in launched.items()} == BEFORE_FRANKA_SIM
    simulated = blocks("franka-sim.yaml")
    assert simulated["franka_driver"].items() <= started["robot_bridge.franka"].items()
    assert simulated["skill_server"].items() <= started["skill_server"].items()


def test_a_launched_robot_at_a_bench_has_the_parameters_of_a_started_one():
    chosen = DomainChoice("stack_at_target", "fair")
    settings = RunSettings(chosen, 1, 0, "lazy", None, world="mujoco", servo=True, scene="my.yaml")
    launched, started = blocks("servo.yaml"), node_parameters(settings)
    for name, node in (("servo_bridge", "servo"), ("mujoco_robot", "mujoco")):
        given = {key: as_default(value) for key, value in launched[name].items()}
        assert given.items() <= started[f"robot_bridge.{node}"].items()
    assert launched["servo_bridge"]["gripper_effort"] == HandModel().grip_n
    assert started["robot_bridge.servo"]["scene"] == "my.yaml"


def test_a_launched_camera_at_a_bench_has_the_parameters_of_a_started_one():
    chosen = DomainChoice("stack_at_target", "fair")
    robot = {"camera": True}
    settings = RunSettings(
        chosen, 1, 0, "lazy", None, world="mujoco", servo=True, scene="my.yaml", mujoco=robot
    )
    launched, started = blocks("servo_camera.yaml"), node_parameters(settings)
    nodes = {"servo_bridge": "servo", "mujoco_robot": "mujoco", "tag_detector": "tag_detector"}
    assert set(launched) == set(nodes)
    for name, node in nodes.items():
        assert launched[name].items() <= started[f"robot_bridge.{node}"].items()
    assert {started[f"robot_bridge.{node}"]["scene"] for node in ("mujoco", "tag_detector")} == {
        "my.yaml"
    }
