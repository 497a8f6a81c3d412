# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that is closed has everything that was sent before."""

from time import sleep

import pytest

from ensemble.client import RunClient
from ensemble.interfaces import CLOSE_BAG, COMMAND
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.bags import read_bag

LIMIT = 120.0  # s, far more than anything here takes
SENT = 50  # messages


@pytest.mark.parametrize("late", ["with the request", "after the request"])
def test_a_recorder_that_was_kept_waiting_reads_what_waits_for_it(network, tmp_path, late):
    """As on a busy machine: nothing of this process runs for longer than the recorder's quiet."""
    bag = tmp_path / "bag"
    settings = RunSettings("obstacle2d", "fair", 3, 0, "lazy", bag, shortcuts="none")
    nodes = {name: node_parameters(settings)[name] for name in ("sim_node", "recorder_node")}
    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        commands = client.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        close = client.create_client(CLOSE_BAG.type, CLOSE_BAG.name)
        assert spinner.spin_until(close.service_is_ready, LIMIT)
        assert spinner.spin_until(lambda: commands.get_subscription_count() == 2, LIMIT)
        assert spinner.spin_until(lambda: list(bag.glob("*.mcap")), LIMIT)
        spinner.spin_until(lambda: False, 0.5)
        if late == "with the request":
            send(commands)
            answer = close.call_async(CLOSE_BAG.type.Request())
        else:
            answer = close.call_async(CLOSE_BAG.type.Request())
            spinner.spin_until(lambda: False, 0.1)
            send(commands)
        sleep(1.0)
        assert spinner.spin_until(answer.done, LIMIT)
    recorded = [topic for topic, *_ in read_bag(bag) if topic == f"/{COMMAND.name}"]
    assert len(recorded) == SENT


def send(commands):
    """Commands for an episode that is not there: the simulator refuses them."""
    for step in range(SENT):
        commands.publish(COMMAND.type(episode=9, step=step, deltas=[0.0, 0.0]))
