# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole ensemble: ``ros2 launch slap_ros ensemble.launch.py domain:=obstacle2d seed:=3``.

On a robot: ``domain:=obstacle_tower world:=robot scene:=FILE``, or ``world:=mock`` without one.

It waits for a task to be asked for:
``ros2 action send_goal /slap/solve_task slap_msgs/action/SolveTask '{max_replans: 5}'``
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import LaunchConfigurationEquals, LaunchConfigurationNotEquals
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "domain": ("obstacle2d", "which domain"),
    "preset": ("fair", "fair: random tasks; paper: the paper's start states"),
    "seed": ("0", "samples the task"),
    "index": ("0", "which of the seed's tasks"),
    "planner": ("lazy", "lazy, exhaustive or ff"),
    "shortcuts": ("", "folder of a shortcut library, or none; empty: the shipped one"),
    "samples": ("16", "attempts of a shortcut in the model; the shortest is used"),
    "world": ("sim", "sim; robot: the bridge; mock: the bridge with a mock robot behind it"),
    "scene": ("", "a robot's scene file; empty: the sampled task's objects"),
    "arm": ("panda", "a robot's: panda or fr3"),
    "latency": ("0.02", "s, the mock robot's"),
    "pose_noise": ("0.002", "m, the mock robot's"),
    "dropout": ("0.0", "share of detections that the mock robot loses"),
    "pace": ("0.0", "environment steps a second, for watching; 0: at full speed"),
    "record": ("", "folder of the bag to record; empty: none"),
    "rviz": ("false", "open RViz as well"),
    "namespace": ("", "of every node: /robot1 gives /robot1/slap/state"),
}


def generate_launch_description() -> LaunchDescription:
    """Describe the ensemble."""
    folder = Path(get_package_share_directory("slap_ros")) / "config"
    config = folder / "ensemble.yaml"

    def value(name: str, kind: type) -> ParameterValue:
        return ParameterValue(LaunchConfiguration(name), value_type=kind)

    def node(name: str, parameters: dict[str, ParameterValue], **options: object) -> Node:
        return Node(
            package="slap_ros",
            executable=name,
            name=name,
            namespace=LaunchConfiguration("namespace"),
            parameters=[str(config), parameters],
            output="screen",
            **options,
        )

    task = {"domain": value("domain", str), "preset": value("preset", str)}
    task |= {"seed": value("seed", int), "index": value("index", int)}
    arm = {"arm": value("arm", str)}
    noise = {name: value(name, float) for name in ("latency", "pose_noise", "dropout")}
    # A robot takes its time to move and to look.
    patience = ParameterValue(
        PythonExpression(["2.0 if '", LaunchConfiguration("world"), "' == 'sim' else 8.0"]),
        value_type=float,
    )
    learned = {"shortcuts": value("shortcuts", str), "samples": value("samples", int)}
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=description)
                for name, (default, description) in ARGUMENTS.items()
            ),
            node(
                "sim_node",
                task | {"pace": value("pace", float)},
                condition=LaunchConfigurationEquals("world", "sim"),
            ),
            node(
                "robot_bridge",
                task | arm | {"scene": value("scene", str)},
                condition=LaunchConfigurationNotEquals("world", "sim"),
            ),
            node(
                "mock_robot",
                task | arm | noise,
                condition=LaunchConfigurationEquals("world", "mock"),
            ),
            node("perception_node", {}),
            node("skill_server", learned | {"state_timeout": patience}),
            node("planner_node", {"planner": value("planner", str)} | learned),
            node(
                "recorder_node",
                {"bag": value("record", str)},
                condition=LaunchConfigurationNotEquals("record", ""),
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                name="rviz",
                arguments=["-d", str(folder / "slap.rviz")],
                remappings=[
                    (topic, [LaunchConfiguration("namespace"), topic])
                    for topic in ("/slap/markers", "/tf", "/tf_static")
                ],
                condition=LaunchConfigurationEquals("rviz", "true"),
            ),
        ]
    )
