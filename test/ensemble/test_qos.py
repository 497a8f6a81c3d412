# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What publishers offer and what bags say they offered: ``ros2 bag play`` offers what bags say."""

import pytest
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from ensemble.client import RunClient
from ensemble.entry_point import run_node
from ensemble.interfaces import DOMAIN, JOINT_STATES, MARKERS, RECORDED, STATE, TF_STATIC
from ensemble.launcher import InProcessLauncher
from ensemble.spinner import temporary_node
from sim_node.node import SimNode
from slap_ros.bags.rosbag2 import TopicRecord
from slap_ros.errors import ErrorCode

LIMIT = 120.0  # s


@pytest.mark.parametrize("namespace", ["", "/robot1"])
@pytest.mark.parametrize("topic", [*RECORDED, TF_STATIC], ids=lambda topic: topic.name)
def test_a_bag_says_what_the_publishers_offer(topic, namespace):
    (said,) = TopicRecord(f"{namespace}/{topic.name}", topic.type_name, "").qos
    assert said["depth"] == topic.qos.depth
    for policy in ("history", "reliability", "durability"):
        assert said[policy] == getattr(topic.qos, policy).name.lower()


def test_publishers_are_seen_to_offer_what_a_bag_says(network):
    nodes = {"sim_node": {"domain": "obstacle_tower"}}
    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        for topic in (DOMAIN, STATE, MARKERS, JOINT_STATES):
            name = f"/{topic.name}"
            assert spinner.spin_until(lambda: client.count_publishers(name), LIMIT)  # noqa: B023
            (seen,) = client.get_publishers_info_by_topic(name)
            (said,) = TopicRecord(name, topic.type_name, "").qos
            assert seen.qos_profile.durability.name.lower() == said["durability"]
            assert seen.qos_profile.reliability.name.lower() == said["reliability"]


OVERRIDES = """
/**:
  ros__parameters:
    qos_overrides:
      /slap/state:
        publisher: {reliability: best_effort, durability: volatile, depth: 7}
        subscription: {reliability: best_effort, durability: volatile}
"""


def test_parameters_override_the_qos_of_states_and_of_nothing_else(network, tmp_path):
    (tmp_path / "qos.yaml").write_text(OVERRIDES)
    arguments = ["--ros-args", "--params-file", str(tmp_path / "qos.yaml")]
    states = []

    def client_node():
        return RunClient(lambda kind, _: states.append(kind), cli_args=arguments)

    with temporary_node(client_node) as (client, spinner):
        world = SimNode(cli_args=arguments)
        spinner.executor.add_node(world)
        try:
            assert world.get_parameter("qos_overrides./slap/state.publisher.depth").value == 7
            assert spinner.spin_until(lambda: client.count_publishers("/slap/markers"), LIMIT)
            offered = {
                topic.name: client.get_publishers_info_by_topic(f"/{topic.name}")[0].qos_profile
                for topic in (DOMAIN, STATE, MARKERS)
            }
            assert offered[STATE.name].reliability == ReliabilityPolicy.BEST_EFFORT
            assert offered[STATE.name].durability == DurabilityPolicy.VOLATILE
            for topic in (DOMAIN, MARKERS):
                assert offered[topic.name].reliability == ReliabilityPolicy.RELIABLE
                assert offered[topic.name].durability == DurabilityPolicy.TRANSIENT_LOCAL
            assert STATE.qos.reliability == ReliabilityPolicy.RELIABLE  # of nodes made later
            assert spinner.spin_until(lambda: client.count_subscribers("/slap/state") == 1, LIMIT)
            world._begin(world._domain.task(1))
            assert spinner.spin_until(lambda: STATE.type_name in states, LIMIT)
        finally:
            world.destroy_node()


@pytest.mark.parametrize(
    ("policy", "value"), [("reliability", "perhaps"), ("history", "keep_all"), ("depth", "many")]
)
def test_an_override_that_cannot_be_ends_a_node_with_a_code(network, policy, value, capfd):
    name = f"qos_overrides./slap/markers.publisher.{policy}"

    def world():
        return SimNode(parameter_overrides=[Parameter(name, value=value)])

    assert run_node("sim_node", world) == ErrorCode.INVALID_PARAMETER
    assert "qos_overrides" in capfd.readouterr().err


def test_a_topic_of_others_has_the_default_of_ros_2():
    (said,) = TopicRecord("/camera/points", "sensor_msgs/msg/PointCloud2", "").qos
    assert (said["depth"], said["durability"]) == (10, "volatile")
