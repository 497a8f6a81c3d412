# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who is there: nodes, topics and services of other processes."""

from __future__ import annotations

from collections.abc import Callable

import rclpy
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String

from conftest import Process, wait_until
from embedded_ros.types import message_type_hash

Run = Callable[..., Process]
# Ours is one more. Each takes a participant index, of which CycloneDDS long had but ten.
PROCESSES = 11


def test_another_process_is_seen_whole(node: Node, run: Run) -> None:
    run("adder", "--ros-args", "-r", "__ns:=/slap").wait_for_line("ready")
    assert wait_until(lambda: ("adder", "/slap") in node.get_node_names_and_namespaces())
    # Endpoints, and whose they are, arrive each on their own; "add" and "status" are the last.
    assert wait_until(lambda: "/slap/add" in served_by_adder(node))
    assert wait_until(lambda: "/slap/status" in published_by_adder(node))
    assert node.count_publishers("/slap/status") == 1
    assert node.get_fully_qualified_node_names().count("/slap/adder") == 1
    topics = dict(node.get_topic_names_and_types())
    assert topics["/slap/status"] == ["diagnostic_msgs/msg/DiagnosticStatus"]
    assert topics["/parameter_events"] == ["rcl_interfaces/msg/ParameterEvent"]
    services = dict(node.get_service_names_and_types())
    assert services["/slap/add"] == ["example_interfaces/srv/AddTwoInts"]
    assert services["/slap/adder/set_parameters"] == ["rcl_interfaces/srv/SetParameters"]
    assert node.count_services("/slap/add") == 1
    assert node.count_clients("/slap/add") == 0
    assert "/tester/set_parameters" not in served_by_adder(node)
    assert "/slap/parameter_events" not in published_by_adder(node)
    (info,) = node.get_publishers_info_by_topic("/slap/status")
    assert (info.node_name, info.node_namespace) == ("adder", "/slap")
    assert info.topic_type == "diagnostic_msgs/msg/DiagnosticStatus"
    assert str(info.topic_type_hash) == message_type_hash("diagnostic_msgs/msg/DiagnosticStatus")
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert info.qos_profile.depth == 10


def served_by_adder(node: Node) -> dict[str, list[str]]:
    return dict(node.get_service_names_and_types_by_node("adder", "/slap"))


def published_by_adder(node: Node) -> dict[str, list[str]]:
    return dict(node.get_publisher_names_and_types_by_node("adder", "/slap"))


def test_a_destroyed_node_vanishes(node: Node) -> None:
    other = Node("other", context=node.context)
    other.create_publisher(String, "topic", 10)
    assert set(node.get_node_names()) == {"tester", "other"}
    assert node.count_publishers("topic") == 1
    other.destroy_node()
    assert node.get_node_names() == ["tester"]
    assert node.count_publishers("topic") == 0


def test_contexts_of_one_process_see_each_other(domain: int) -> None:
    contexts = [rclpy.Context() for _ in range(3)]
    for context in contexts:
        rclpy.init(args=[], context=context, domain_id=domain)
    nodes = [Node(f"n{index}", context=context) for index, context in enumerate(contexts)]
    for node in nodes:
        assert wait_until(lambda node=node: set(node.get_node_names()) == {"n0", "n1", "n2"})
    for context in contexts:
        rclpy.shutdown(context=context)


def test_many_processes_share_a_domain(node: Node, run: Run) -> None:
    code = (
        "import os, sys, rclpy, rclpy.node\n"
        "for name in sys.argv[1:]:\n"
        "    if os.fork() == 0:\n"  # forked, as a dozen interpreters take long to start
        "        rclpy.init(args=[])\n"
        "        node = rclpy.create_node(name)\n"
        "        break\n"
        "sys.stdin.read()\n"  # up to the end of the test
    )
    names = [f"n{index}" for index in range(PROCESSES)]
    run(*names, code=code)
    wait_until(lambda: set(names) <= set(node.get_node_names()))
    assert set(names) - set(node.get_node_names()) == set()
