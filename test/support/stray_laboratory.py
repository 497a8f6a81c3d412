# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An ensemble in this process, and a publisher that does not belong to it."""

from contextlib import contextmanager
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.interfaces import ATOMS, DIAGNOSTICS, DOMAIN, FAULT, STATE, TASK
from ensemble.nodes import RunSettings, node_class, node_parameters
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import EnsembleBench, one_executor

LISTENERS = ("/perception_node", "/planner_node", "/skill_server")
HEARD_BY = {DOMAIN.name: 6, TASK.name: 6, STATE.name: 6, ATOMS.name: 5, FAULT.name: 4}  # nodes


class StrayLaboratory(EnsembleBench):
    """An ensemble, and a publisher that does not belong to it."""

    def __init__(self, client, spinner, nodes):
        super().__init__(client, spinner)
        self.nodes = nodes
        self.newest, self.health = dict.fromkeys((FAULT.name,)), {}
        for topic in (DOMAIN, TASK, STATE, ATOMS, FAULT):
            client.create_subscription(
                topic.type, topic.name, partial(self._on_message, topic.name), topic.qos
            )
        client.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._on_health, DIAGNOSTICS.qos
        )

    def _on_message(self, name, message):
        self.newest[name] = message

    def _on_health(self, message):
        for status in message.status:
            self.health[status.name] = {item.key: item.value for item in status.values}

    def refused(self, kind):
        """By every node that listens, so far."""
        return [int(self.health.get(name, {}).get(kind, 0)) for name in LISTENERS]

    def more_refused(self, kind, before):
        return all(now > then for now, then in zip(self.refused(kind), before, strict=True))

    def episode_from(self, seed):
        """A new episode, of which every topic has been heard."""
        episode = self.reset(seed)
        self.until(
            lambda: all(self.newest[t.name].episode == episode for t in (TASK, STATE, ATOMS))
        )
        return episode

    @contextmanager
    def published(self, topic, message, kind):
        """What all the others heard, and refused if it is of a kind that is."""
        before = self.refused(kind)
        stray = self.client.create_publisher(topic.type, topic.name, topic.qos)
        # Heard by this client, the recorder, and whoever acts on it.
        reached = HEARD_BY[topic.name]
        self.until(lambda: stray.get_subscription_count() >= reached)
        stray.publish(message)
        self.until(lambda: self.newest[topic.name] == message)
        if kind is not None:
            self.until(lambda: self.more_refused(kind, before))
        try:
            yield
        finally:
            self.client.destroy_publisher(stray)


@contextmanager
def laboratory(bag):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", bag, shortcuts="none", patience=5.0
    )
    with one_executor() as (nodes, spinner):
        nodes.append(client := RunClient(lambda *_: None))
        bench = StrayLaboratory(client, spinner, nodes)
        for name, parameters in node_parameters(settings).items():
            overrides = [Parameter(key, value=value) for key, value in parameters.items()]
            nodes.append(node_class(name)(parameter_overrides=overrides))
        for node in nodes:
            spinner.executor.add_node(node)
        bench.until(lambda: client.ready(True) and len(bench.newest) == 5)
        yield bench
