# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that is closed has everything that was sent before."""

from contextlib import contextmanager
from time import sleep

import pytest
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.interfaces import CLOSE_BAG, COMMAND, DOMAIN, TASK
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from recorder_node.node import RecorderNode
from slap_ros.bags import read_bag
from slap_ros.skills.domain_choice import DomainChoice

LIMIT = 120.0  # s, far more than anything here takes
SENT = 50  # messages


@pytest.mark.parametrize("late", ["with the request", "after the request"])
def test_a_recorder_that_was_kept_waiting_reads_what_waits_for_it(network, tmp_path, late):
    """As on a busy machine: nothing of this process runs for longer than the recorder's quiet."""
    bag = tmp_path / "bag"
    settings = RunSettings(DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", bag, shortcuts="none")
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


@contextmanager
def recorded(bag, **parameters):
    """A simulator and a recorder, a client of both, and whoever sends commands."""
    settings = RunSettings(DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", bag, shortcuts="none")
    nodes = {name: node_parameters(settings)[name] for name in ("sim_node", "recorder_node")}
    nodes["recorder_node"] |= parameters
    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        commands = client.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        assert spinner.spin_until(lambda: commands.get_subscription_count() == 2, LIMIT)
        assert spinner.spin_until(lambda: client.newest.get(DOMAIN.type_name), LIMIT)
        yield client, spinner, commands


def test_a_bag_is_closed_beside_somebody_who_never_stops(network, tmp_path):
    with recorded(tmp_path / "bag") as (client, spinner, commands):
        client.create_timer(0.005, lambda: send(commands))
        close = client.create_client(CLOSE_BAG.type, CLOSE_BAG.name)
        assert spinner.spin_until(close.service_is_ready, LIMIT)
        assert spinner.spin_until(lambda: list((tmp_path / "bag").glob("*.mcap")), LIMIT)
        answer = close.call_async(CLOSE_BAG.type.Request())
        assert spinner.spin_until(answer.done, LIMIT)
        assert answer.result().success
        again = close.call_async(CLOSE_BAG.type.Request())
        assert spinner.spin_until(again.done, LIMIT)
        assert (again.result().success, again.result().message) == (True, str(tmp_path / "bag"))
    assert [topic for topic, *_ in read_bag(tmp_path / "bag") if topic == "/slap/task"]


def test_a_bag_is_finished_before_strangers_fill_the_disk(network, tmp_path, capfd):
    with recorded(tmp_path / "bag", limit=0.05) as (client, spinner, commands):
        said = []
        client.create_timer(0.01, lambda: send(commands))

        def is_full():
            said.append(capfd.readouterr().err)
            return "0.05 MB were published: parameter limit" in "".join(said)

        assert spinner.spin_until(is_full, LIMIT)
        spinner.spin_until(lambda: False, 0.5)
        read = list(read_bag(tmp_path / "bag"))  # it is whole, though the recorder goes on
    assert [topic for topic, *_ in read if topic == "/slap/task"]
    assert sum(file.stat().st_size for file in (tmp_path / "bag").iterdir()) < 400_000


def test_a_bag_begins_though_other_domains_are_announced(network, tmp_path):
    bag = tmp_path / "bag"
    with temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner):
        domains, tasks = (
            client.create_publisher(topic.type, topic.name, topic.qos) for topic in (DOMAIN, TASK)
        )
        recorder = RecorderNode(parameter_overrides=[Parameter("bag", value=str(bag))])
        spinner.executor.add_node(recorder)
        heard = [publisher.get_subscription_count for publisher in (domains, tasks)]
        assert spinner.spin_until(lambda: all(count() == 2 for count in heard), LIMIT)
        domains.publish(DOMAIN.type(name="obstacle2d"))
        domains.publish(DOMAIN.type(name="moon"))
        tasks.publish(TASK.type(domain="obstacle2d", seed=7))
        tasks.publish(TASK.type(domain="mars"))
        assert spinner.spin_until(lambda: list(bag.glob("*.mcap")), LIMIT)
        recorder.destroy_node()


def send(commands):
    """Commands for an episode that is not there: the simulator refuses them."""
    for step in range(SENT):
        commands.publish(COMMAND.type(episode=9, step=step, deltas=[0.0, 0.0]))
