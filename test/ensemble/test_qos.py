# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What publishers offer and what bags say they offered: ``ros2 bag play`` offers what bags say."""

import pytest

from ensemble.client import RunClient
from ensemble.interfaces import DOMAIN, JOINT_STATES, MARKERS, RECORDED, STATE, TF_STATIC
from ensemble.launcher import InProcessLauncher
from ensemble.spinner import temporary_node
from slap_ros.bags.rosbag2 import TopicRecord

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


def test_a_topic_of_others_has_the_default_of_ros_2():
    (said,) = TopicRecord("/camera/points", "sensor_msgs/msg/PointCloud2", "").qos
    assert (said["depth"], said["durability"]) == (10, "volatile")
