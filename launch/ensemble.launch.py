# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole ensemble: ``ros2 launch slap_ros ensemble.launch.py domain:=obstacle2d seed:=3``.

On a robot: ``domain:=obstacle_tower world:=robot scene:=FILE``. Without one: ``world:=mock``, or
``world:=mujoco`` for a robot in another engine than the planner's; there, ``camera:=true
scene:=FILE`` has a camera see tagged objects. On a Franka arm by its own protocol:
``world:=franka ip:=172.16.0.2 scene:=FILE``; on a simulated one: ``world:=franka-sim``.
A domain of the contact world on a robot in MuJoCo: ``domain:=stack_at_target world:=mujoco
servo:=true``.

``params_file:=FILE`` sets any other parameter of any node, in a copy of ``config/ensemble.yaml``.

It waits for a task to be asked for:
``ros2 action send_goal /slap/solve_task slap_msgs/action/SolveTask '{max_replans: 5}'``
"""

import os
from collections.abc import Mapping
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import Action, LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    LogInfo,
    OpaqueFunction,
    SetEnvironmentVariable,
)
from launch.conditions import IfCondition
from launch.events.process import ProcessExited
from launch.logging import get_logger
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from slap_ros.doctor.settings import RANGE, RANGE_HINT
from slap_ros.errors import InvalidParameterError

ARGUMENTS = {
    "world": (
        "sim",
        "sim; the bridge to a robot: robot, franka; to a simulated one: mock, mujoco, franka-sim",
    ),
    "params_file": ("", "parameter file for all nodes, such as a changed copy of ensemble.yaml"),
    "acquisition": (
        "false",
        "run acquisition_node too: it proposes operators and acquires skills",
    ),
    "camera": (
        "false",
        "start tag_detector, for the tags of the scene file; a robot in MuJoCo has a camera then",
    ),
    "servo": (
        "false",
        "command the robot while it moves, as domains of the contact world need it",
    ),
    "record": ("", "folder of the bag to record; empty: none"),
    "rviz": ("false", "open RViz as well"),
    "namespace": ("", "namespace of every node: /robot1 gives /robot1/slap/state"),
}
ROBOTS = {  # nodes that are a robot or drive one, by world
    "mock": "mock_robot",
    "mujoco": "mujoco_robot",
    "franka": "franka_driver",
    "franka-sim": "franka_driver",
}
CHOICES = {"world": ["sim", "robot", *ROBOTS]} | {
    name: ["true", "false"] for name in ("acquisition", "camera", "servo", "rviz")
}
# Parameter files that go before ensemble.yaml and robot.yaml, by world.
CONFIGURED = {
    "mujoco": ["mujoco.yaml"],
    "franka": ["franka.yaml"],
    "franka-sim": ["franka.yaml", "franka-sim.yaml"],
}
# Arguments that are parameters of nodes. They have no defaults here: a node's parameter that is not
# given is what the parameter files say.
PARAMETERS = {
    "domain": (str, "name of the domain"),
    "preset": (str, "fair: random tasks; paper: the paper's start states"),
    "skills": (str, "none, demonstrator, or a folder of acquired skills"),
    "seed": (int, "seed that samples the task"),
    "index": (int, "which of the seed's tasks"),
    "goal": (str, "goal of the task, by name or as atoms"),
    "planner": (str, "planner: anytime, lazy, exhaustive, ff or astar"),
    "shortcuts": (str, "folder of a shortcut library, none, or grown"),
    "samples": (int, "attempts of a shortcut in the model; the shortest is used"),
    "scene": (str, "scene file of a robot"),
    "arm": (str, "arm of a robot: panda or fr3"),
    "speed": (float, "fraction of the arm's limits of velocity and acceleration"),
    "ip": (str, "address of a Franka arm"),
    "latency": (float, "latency of a simulated robot, s"),
    "pose_noise": (float, "noise of a simulated robot's detections, m"),
    "dropout": (float, "share of detections that a simulated robot loses"),
    "pace": (float, "environment steps per second, for watching; 0: at full speed"),
    "patience": (float, "factor of all deadlines, for slow domains and machines"),
    "language_settings": (str, "JSON file with model and server, for acquisition_node"),
}
TASK = ("domain", "preset", "skills", "goal", "seed", "index")
COMMON = ("domain", "preset", "skills", "patience")
SHORTCUTS = ("shortcuts", "samples")
TAKEN = {  # arguments that each node takes as its parameters
    "sim_node": (*TASK, "pace"),
    "robot_bridge": (*TASK, "arm", "scene", "speed"),
    "servo_bridge": (*TASK, "arm", "scene"),
    "mock_robot": (*TASK, "arm", "latency", "pose_noise", "dropout"),
    "mujoco_robot": (*TASK, "arm", "latency", "pose_noise", "dropout", "scene"),
    "franka_driver": (*TASK, "arm", "ip", "speed"),
    "tag_detector": ("domain", "preset", "skills", "scene"),
    "perception_node": COMMON,
    "skill_server": (*COMMON, *SHORTCUTS),
    "planner_node": (*COMMON, *SHORTCUTS, "planner"),
    "acquisition_node": (*COMMON, "language_settings"),
    "recorder_node": (),
}


def generate_launch_description() -> LaunchDescription:
    """Describe the ensemble."""
    arguments = [
        DeclareLaunchArgument(
            name, default_value=default, description=description, choices=CHOICES.get(name)
        )
        for name, (default, description) in ARGUMENTS.items()
    ]
    arguments += [
        DeclareLaunchArgument(
            name, default_value="", description=f"{description}; empty: as the parameter file says"
        )
        for name, (_, description) in PARAMETERS.items()
    ]
    # RViz first: where it is not installed, launch fails and would leave nodes behind.
    return LaunchDescription(
        [*arguments, *_discovery_range(), _rviz(), OpaqueFunction(function=_nodes)]
    )


def _discovery_range() -> list[Action]:
    """What every node would choose for itself: here once for all, RViz too, and said once."""
    if RANGE in os.environ:
        return []
    return [SetEnvironmentVariable(RANGE, "LOCALHOST"), LogInfo(msg=RANGE_HINT)]


def _nodes(context: LaunchContext) -> list[Node]:
    """The nodes that the arguments ask for."""
    given = {name: value for name, value in context.launch_configurations.items() if value}
    bridge = "servo_bridge" if given["servo"] == "true" else "robot_bridge"
    names = ["sim_node"] if given["world"] == "sim" else [bridge]
    names += [ROBOTS[given["world"]]] if given["world"] in ROBOTS else []
    names += ["tag_detector"] if given["camera"] == "true" else []
    names += ["perception_node", "skill_server", "planner_node"]
    names += ["recorder_node"] if "record" in given else []
    acquires = IfCondition(LaunchConfiguration("acquisition"))
    return [
        *(_node(name, given) for name in names),
        _node("acquisition_node", given, condition=acquires),
    ]


def _node(name: str, given: Mapping[str, str], **options: object) -> Node:
    """A node of the ensemble: what is given goes before files, and a user's file before ours."""
    taken = {key: _value(key, given[key]) for key in TAKEN[name] if key in given}
    if name == "recorder_node":
        taken["bag"] = ParameterValue(given["record"], value_type=str)
        options["on_exit"] = _say_unrecorded
    if name == "mujoco_robot" and given["camera"] == "true":
        taken["camera"] = ParameterValue(True, value_type=bool)
    return Node(
        package="slap_ros",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        parameters=[*_parameter_files(given), *([taken] if taken else [])],
        output="screen",
        **options,
    )


def _say_unrecorded(_: ProcessExited, context: LaunchContext) -> None:
    """Say that the recorder has ended before the others. They go on: a robot may be moving."""
    if not context.is_shutdown:
        get_logger("recorder_node").error(
            "recorder_node has ended: NOTHING IS RECORDED from now on, and the other nodes go on. "
            "What it has recorded stays readable. To record, launch again with another record:="
        )


def _value(name: str, text: str) -> ParameterValue:
    """An argument as a parameter.

    Raises:
        InvalidParameterError: It is no number where one is wanted.
    """
    kind, _ = PARAMETERS[name]
    try:
        return ParameterValue(kind(text), value_type=kind)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        raise InvalidParameterError(f"{name} must be {wanted}, not {text!r}") from None


def _parameter_files(given: Mapping[str, str]) -> list[str]:
    """Parameter files, each of which goes before those in front of it.

    Raises:
        InvalidParameterError: The user's is not there.
    """
    files = [_config() / "ensemble.yaml"]
    if given["world"] != "sim":
        files.append(_config() / "robot.yaml")
    files += [_config() / name for name in CONFIGURED.get(given["world"], ())]
    if given["servo"] == "true":
        files.append(_config() / "servo.yaml")
    if given["world"] == "mujoco" and given["camera"] == "true":
        files.append(_config() / "camera.yaml")
        if given["servo"] == "true":
            files.append(_config() / "servo_camera.yaml")
    if "params_file" in given:
        files.append(Path(given["params_file"]).expanduser())
        if not files[-1].is_file():
            raise InvalidParameterError(f"params_file: there is no file {files[-1]}")
    return [str(file) for file in files]


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


def _config() -> Path:
    return Path(get_package_share_directory("slap_ros")) / "config"
