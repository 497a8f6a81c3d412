# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An ensemble in which one node hears one topic through a relay that loses, repeats or delays."""

from contextlib import contextmanager
from dataclasses import dataclass
from random import Random

from rclpy.node import Node
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.interfaces import ATOMS, COMMAND, DOMAIN, LATCHED, STATE, TASK
from ensemble.nodes import RunSettings, node_class, node_parameters
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import EnsembleBench, one_executor

HEARD = {
    "perception_node": (DOMAIN, TASK, STATE),
    "skill_server": (DOMAIN, TASK, STATE, ATOMS),
    "planner_node": (DOMAIN, TASK, STATE, ATOMS),
    "sim_node": (COMMAND,),
}
LINKS = [(receiver, topic) for receiver, topics in HEARD.items() for topic in topics]
# What is waited for in vain, and then reported, is waited for less long than in a laboratory.
IMPATIENT = {"planner_node": {"observation_timeout": 2.0}}


class Relay(Node):
    """Hands the messages of a topic on to one receiver, as ``fault`` has it.

    Args:
        receiver: The node that hears it.
        topic: What it relays, as raw bytes.
        fault: One of ``FAULTS``.
        rng: Decides.
    """

    def __init__(self, receiver, topic, fault, rng):
        super().__init__("relay")
        self.fault, self.met = fault, 0
        self._rng = rng
        self._past, self._due = [], []
        self._broken = False
        self._latched = topic.qos is LATCHED
        # There are few messages on a latched topic.
        self.rarely, self.often = (0.5, 0.5) if self._latched else (0.05, 0.3)
        self._out = self.create_publisher(topic.type, faulty_name(receiver, topic), topic.qos)
        self.create_subscription(topic.type, topic.name, self._on_message, topic.qos, raw=True)

    def heal(self):
        """From now on everything is handed on as it comes."""
        self.fault = deliver
        self._due.clear()
        if self._latched and self._past:  # as the middleware does for whoever is connected again
            self.send(self._past[-1])

    def _on_message(self, raw):
        self.fault(self, bytes(raw))
        self._past.append(bytes(raw))

    def strikes(self, chance):
        struck = self._rng.random() < chance
        self.met += struck
        return struck

    def send(self, raw):
        self._out.publish(raw)

    def send_later(self, raw, longest_s):
        timer = self.create_timer(self._rng.uniform(0.001, longest_s), lambda: send())
        self._due.append(raw)

        def send():
            self.destroy_timer(timer)
            if raw in self._due:  # not healed meanwhile
                self._due.remove(raw)
                self.send(raw)

    def send_in_turn(self, longest_s):
        """Send the oldest of what is due, later."""
        timer = self.create_timer(self._rng.uniform(0.001, longest_s), lambda: send())

        def send():
            self.destroy_timer(timer)
            if self._due:
                self.send(self._due.pop(0))

    def hold_back(self, raw):
        self._due.append(raw)

    def any_of_the_past(self):
        return self._rng.choice(self._past) if self._past else None

    def break_down(self):
        self._broken = True

    @property
    def broken(self):
        return self._broken


def deliver(relay, raw):
    relay.send(raw)


def drop(relay, raw):
    if not relay.strikes(relay.rarely):
        relay.send(raw)


def cut(relay, raw):
    if relay.broken or relay.strikes(relay.rarely):
        relay.break_down()
    else:
        relay.send(raw)


def duplicate(relay, raw):
    for _ in range(1 + 2 * relay.strikes(relay.often)):
        relay.send(raw)


def delay(relay, raw):
    relay.strikes(1.0)
    relay.hold_back(raw)
    relay.send_in_turn(0.03)


def overtake(relay, raw):
    """Some of the past comes again, before or after what is new."""
    old = relay.any_of_the_past()
    again = old is not None and relay.strikes(relay.often)
    if again:
        relay.send(old)
    relay.send(raw)
    if again:
        relay.send(old)


def shuffle(relay, raw):
    relay.strikes(1.0)
    for _ in range(2):
        relay.send_later(raw, 0.03)


FAULTS = (drop, cut, duplicate, delay, overtake, shuffle)


@dataclass(frozen=True)
class Case:
    """What goes wrong, all of it from a seed."""

    receiver: str
    topic: object
    fault: object
    seed: int

    @classmethod
    def sampled(cls, number):
        """Consecutive numbers go through every fault on every link, with ever new seeds."""
        receiver, topic = LINKS[number // len(FAULTS) % len(LINKS)]
        return cls(receiver, topic, FAULTS[number % len(FAULTS)], number)

    def __str__(self):
        name = self.topic.name.removeprefix("slap/")
        return f"{self.seed}-{self.fault.__name__}-{name}-{self.receiver}"


def faulty_name(receiver, topic):
    return f"faulty/{receiver}/{topic.name}"


class FaultyEnsemble(EnsembleBench):
    """The ensemble, a client and the relay, on one executor."""

    def __init__(self, client, spinner, relay):
        super().__init__(client, spinner)
        self.relay = relay


@contextmanager
def laboratory(case, bag):
    """Everything in this process; ``bag`` is recorded."""
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"), case.seed, 0, "lazy", bag, shortcuts="none"
    )
    with one_executor() as (nodes, spinner):
        nodes.append(client := RunClient(lambda *_: None))
        nodes.append(relay := Relay(case.receiver, case.topic, case.fault, Random(case.seed)))
        for name, parameters in node_parameters(settings).items():
            heard = [case.topic] if name == case.receiver else []
            nodes.append(_node(name, {**parameters, **IMPATIENT.get(name, {})}, heard))
        for node in nodes:
            spinner.executor.add_node(node)
        bench = FaultyEnsemble(client, spinner, relay)
        bench.until(lambda: client.ready(True))
        yield bench


def _node(name, parameters, relayed):
    remaps = [f"{topic.name}:={faulty_name(name, topic)}" for topic in relayed]
    arguments = [part for remap in remaps for part in ("--remap", remap)]
    return node_class(name)(
        parameter_overrides=[Parameter(key, value=value) for key, value in parameters.items()],
        cli_args=["--ros-args", *arguments] if arguments else None,
    )
