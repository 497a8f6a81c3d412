# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole ensemble: ``ros2 launch slap_ros ensemble.launch.py domain:=obstacle2d seed:=3``.

On a robot: ``domain:=obstacle_tower world:=robot scene:=FILE``, or ``world:=mock`` without one.

It waits for a task to be asked for:
``ros2 action send_goal /slap/solve_task slap_msgs/action/SolveTask '{max_replans: 5}'``
"""

import os
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import Action, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, SetEnvironmentVariable
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from slap_ros.doctor.settings import RANGE, RANGE_HINT

ARGUMENTS = {
    "domain": ("obstacle2d", "which domain"),
    "preset": (
        "",
        "fair: random tasks; paper: the paper's start states; empty: the domain's first",
    ),
    "skills": ("", "none, demonstrator, or a folder of acquired skills; empty: what ships"),
    "seed": ("0", "samples the task"),
    "index": ("0", "which of the seed's tasks"),
    "goal": ("", "of the task, by name or as atoms; empty: its own"),
    "planner": ("lazy", "lazy, exhaustive or ff"),
    "shortcuts": ("", "folder of a shortcut library, or none; empty: the shipped one"),
    "samples": ("16", "attempts of a shortcut in the model; the shortest is used"),
    "world": ("sim", "sim; robot: the bridge; mock: the bridge with a mock robot behind it"),
    "scene": ("", "a robot's scene file; empty: the sampled task's objects"),
    "arm": ("panda", "a robot's: panda or fr3"),
    "latency": ("0.02", "s, the mock robot's"),
    "pose_noise": ("0.002", "m, the mock robot's"),
    "dropout": ("0.0", "share of detections that the mock robot loses"),
    "pace": ("0.0", "environment steps per second, for watching; 0: at full speed"),
    "patience": ("1.0", "factor of all deadlines, for slow domains and machines"),
    "acquisition": (
        "false",
        "run acquisition_node too: it proposes operators and acquires skills",
    ),
    "language_settings": ("", "of acquisition_node: JSON file with model and server"),
    "record": ("", "folder of the bag to record; empty: none"),
    "rviz": ("false", "open RViz as well"),
    "namespace": ("", "of every node: /robot1 gives /robot1/slap/state"),
}


def generate_launch_description() -> LaunchDescription:
    """Describe the ensemble."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription(
        [*arguments, *_discovery_range(), *_worlds(), *_solvers(), _recorder(), _rviz()]
    )


def _discovery_range() -> list[Action]:
    """What every node would choose for itself: here once for all, RViz too, and said once."""
    if RANGE in os.environ:
        return []
    return [SetEnvironmentVariable(RANGE, "LOCALHOST"), LogInfo(msg=RANGE_HINT)]


def _worlds() -> list[Node]:
    """The simulator, or the bridge with or without a mock robot behind it."""
    task = {name: _value(name, str) for name in ("domain", "preset", "skills", "goal")}
    task |= {"seed": _value("seed", int), "index": _value("index", int)}
    arm = {"arm": _value("arm", str)}
    noise = {name: _value(name, float) for name in ("latency", "pose_noise", "dropout")}
    return [
        _node(
            "sim_node",
            task | {"pace": _value("pace", float)},
            condition=IfCondition(_is("world", "sim")),
        ),
        _node(
            "robot_bridge",
            task | arm | {"scene": _value("scene", str)},
            condition=UnlessCondition(_is("world", "sim")),
        ),
        _node(
            "mock_robot",
            task | arm | noise,
            condition=IfCondition(_is("world", "mock")),
        ),
    ]


def _solvers() -> list[Node]:
    """Perception, skill server and planner."""
    shortcuts = {"shortcuts": _value("shortcuts", str), "samples": _value("samples", int)}
    # A robot takes its time to move and to be measured.
    state_timeout = ParameterValue(
        PythonExpression(["2.0 if '", LaunchConfiguration("world"), "' == 'sim' else 8.0"]),
        value_type=float,
    )
    common = {name: _value(name, str) for name in ("domain", "preset", "skills")}
    common |= {"patience": _value("patience", float)}
    return [
        _node("perception_node", common),
        _node("skill_server", common | shortcuts | {"state_timeout": state_timeout}),
        _node("planner_node", common | shortcuts | {"planner": _value("planner", str)}),
        _node(
            "acquisition_node",
            common | {"language_settings": _value("language_settings", str)},
            condition=IfCondition(LaunchConfiguration("acquisition")),
        ),
    ]


def _recorder() -> Node:
    return _node(
        "recorder_node",
        {"bag": _value("record", str)},
        condition=UnlessCondition(_is("record", "")),
    )


def _rviz() -> Node:
    return Node(
        package="rviz2",
        executable="rviz2",
        name="rviz",
        arguments=["-d", str(_config() / "slap.rviz")],
        remappings=[
            (topic, [LaunchConfiguration("namespace"), topic])
            for topic in ("/slap/markers", "/tf", "/tf_static")
        ],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )


def _node(name: str, parameters: dict[str, ParameterValue], **options: object) -> Node:
    """A node of the ensemble: defaults from the configuration file, then ``parameters``."""
    return Node(
        package="slap_ros",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        parameters=[str(_config() / "ensemble.yaml"), parameters],
        output="screen",
        **options,
    )


def _is(name: str, value: str) -> EqualsSubstitution:
    return EqualsSubstitution(LaunchConfiguration(name), value)


def _value(name: str, kind: type) -> ParameterValue:
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def _config() -> Path:
    return Path(get_package_share_directory("slap_ros")) / "config"
