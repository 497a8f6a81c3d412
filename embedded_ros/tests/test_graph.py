# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who is there: nodes, topics and services of other processes."""

from __future__ import annotations

import os
from collections.abc import Callable

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String

from conftest import Process, wait_until

Run = Callable[..., Process]


def test_another_process_is_seen_whole(node: Node, run: Run) -> None:
    run("adder", "--ros-args", "-r", "__ns:=/slap").wait_for_line("ready")
    assert wait_until(lambda: ("adder", "/slap") in node.get_node_names_and_namespaces())
    assert wait_until(lambda: node.count_publishers("/slap/status") == 1)
    assert node.get_fully_qualified_node_names().count("/slap/adder") == 1
    topics = dict(node.get_topic_names_and_types())
    assert topics["/slap/status"] == ["diagnostic_msgs/msg/DiagnosticStatus"]
    assert topics["/parameter_events"] == ["rcl_interfaces/msg/ParameterEvent"]
    services = dict(node.get_service_names_and_types())
    assert services["/slap/add"] == ["example_interfaces/srv/AddTwoInts"]
    assert services["/slap/adder/set_parameters"] == ["rcl_interfaces/srv/SetParameters"]
    assert node.count_services("/slap/add") == 1
    assert node.count_clients("/slap/add") == 0
    served = dict(node.get_service_names_and_types_by_node("adder", "/slap"))
    assert "/slap/add" in served
    assert "/tester/set_parameters" not in served
    published = dict(node.get_publisher_names_and_types_by_node("adder", "/slap"))
    assert "/slap/status" in published
    (info,) = node.get_publishers_info_by_topic("/slap/status")
    assert (info.node_name, info.node_namespace) == ("adder", "/slap")
    assert info.topic_type == "diagnostic_msgs/msg/DiagnosticStatus"
    assert info.topic_type_hash.startswith("RIHS01_")
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert info.qos_profile.depth == 10


def test_a_destroyed_node_vanishes(node: Node) -> None:
    other = Node("other", context=node.context)
    other.create_publisher(String, "topic", 10)
    assert set(node.get_node_names()) == {"tester", "other"}
    assert node.count_publishers("topic") == 1
    other.destroy_node()
    assert node.get_node_names() == ["tester"]
    assert node.count_publishers("topic") == 0


def test_many_processes_share_a_domain(node: Node, run: Run) -> None:
    """More participants than CycloneDDS allows by default (10)."""
    code = (
        "import os, rclpy\n"
        "nodes = []\n"
        "for index in range(6):\n"
        "    context = rclpy.Context()\n"
        "    rclpy.init(context=context)\n"
        "    nodes.append(rclpy.create_node(f'n{os.getpid()}_{index}', context=context))\n"
        "print('ready', flush=True)\n"
        "input()\n"
    )
    processes = [run(code=code) for _ in range(3)]
    for process in processes:
        process.wait_for_line("ready")
    assert wait_until(lambda: len(node.get_node_names()) == 19, timeout_s=90.0)
    assert f"n{os.getpid()}_0" not in node.get_node_names()
