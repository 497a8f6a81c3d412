# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Layouts of RViz and Foxglove show what the ensemble really publishes."""

import json
import re
from pathlib import Path

import pytest
import yaml
from rosbags.interfaces import Nodetype

from ensemble.client import RunClient
from ensemble.foxglove_server import SHOWN_TOPICS, channel_name
from ensemble.interfaces import MARKERS
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.messages.typestore import typestore
from slap_ros.skills.domain_choice import DomainChoice

CONFIG = Path(__file__).parents[2] / "config"
RVIZ_TYPES = {"rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray"}
PATH = re.compile(r"(?P<topic>/[\w/]+)(?P<fields>[\w.\[\]:]*)")


def rviz():
    return yaml.safe_load((CONFIG / "slap.rviz").read_text())["Visualization Manager"]


def foxglove():
    return json.loads((CONFIG / "foxglove.json").read_text())


def rviz_topics():
    """Topic and type of each display that has one."""
    displays = [d for d in rviz()["Displays"] if "Topic" in d]
    return [(d["Topic"]["Value"], RVIZ_TYPES[d["Class"]]) for d in displays]


def foxglove_paths():
    """Topic and fields of everything that a panel names."""
    found = []
    for config in foxglove()["configById"].values():
        named = [path["value"] for path in config.get("paths", ())]
        named += [config["topicPath"]] if "topicPath" in config else []
        named += list(config.get("topics", ()))
        found += [PATH.fullmatch(path).groups() for path in named]
    return found


@pytest.fixture
def published(network):
    """Types by topic, where the nodes of a run in Obstacle Tower publish whatever is shown."""
    pytest.importorskip("pybullet")
    settings = RunSettings(
        DomainChoice("obstacle_tower", "fair"), 1, 0, "lazy", None, shortcuts="none"
    )
    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner),
        InProcessLauncher(node_parameters(settings), spinner.executor),
    ):
        shown = {topic for topic, _ in rviz_topics()} | {topic for topic, _ in foxglove_paths()}
        assert spinner.spin_until(lambda: all(map(client.count_publishers, shown)), 120.0), shown
        return dict(client.get_topic_names_and_types())


def test_what_is_shown_is_published_and_has_such_fields(published):
    assert rviz_topics()
    for topic, kind in rviz_topics():
        assert published[topic] == [kind]
    (display,) = [d for d in rviz()["Displays"] if "Topic" in d]
    assert (
        display["Topic"]["Durability Policy"]
        == MARKERS.qos.durability.name.replace("_", " ").title()
    )
    assert set(display["Namespaces"]) == {"bodies", "robot"}

    paths = foxglove_paths()
    assert {topic for topic, _ in paths} >= {"/slap/plan", "/slap/atoms", "/joint_states"}
    for topic, fields in paths:
        (kind,) = published[topic]
        for field in filter(None, re.sub(r"\[[^\]]*\]", "", fields).split(".")):
            members = dict(typestore().fielddefs[kind][1])
            assert field in members, f"{topic} has no {fields}"
            kind = inner_type(members[field])


def inner_type(description):
    """The message type in a field's description, if there is one: of arrays, of an element."""
    node, content = description
    if node == Nodetype.NAME:
        return content
    return inner_type(content[0]) if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) else None


def test_a_live_run_sends_what_foxglove_shows():
    assert {topic for topic, _ in foxglove_paths()} <= {
        channel_name(topic) for topic in SHOWN_TOPICS
    }


def test_every_panel_has_its_place():
    def leaves(node):
        if isinstance(node, str):
            return [node]
        return leaves(node["first"]) + leaves(node["second"])

    layout = foxglove()
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
