# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages of others on the topics of an ensemble: refused, counted, and without consequence."""

from contextlib import contextmanager
from copy import deepcopy
from functools import partial
from threading import Event

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from faulty_links import Laboratory
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from slap_msgs.msg import DomainInfo, EpisodeFault

from ensemble.client import RunClient
from ensemble.episode_tracker import EpisodeTracker
from ensemble.interfaces import ATOMS, DIAGNOSTICS, DOMAIN, FAULT, STATE, TASK
from ensemble.nodes import RunSettings, node_class, node_parameters
from ensemble.refusals import Refusals
from ensemble.spinner import Spinner
from sim_node.node import SimNode
from slap_ros.bags import evaluate_bag
from slap_ros.skills.domain_choice import DomainChoice

pytestmark = pytest.mark.timeout(180)  # an ensemble is heard of in heartbeats alone
LIMIT = 120.0  # s, far more than anything here takes
LISTENERS = ("/perception_node", "/planner_node", "/skill_server")
HEARD_BY = {DOMAIN.name: 6, TASK.name: 6, STATE.name: 6, ATOMS.name: 5, FAULT.name: 4}  # nodes
LATEST = 2**31 - 1  # s since the epoch, in 2038: the last that a stamp can have


class StrayLaboratory(Laboratory):
    """An ensemble, and a publisher that does not belong to it."""

    def __init__(self, client, spinner):
        super().__init__(client, spinner, relay=None)
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
        assert self.spinner.spin_until(
            lambda: all(self.newest[t.name].episode == episode for t in (TASK, STATE, ATOMS)), LIMIT
        )
        return episode

    @contextmanager
    def published(self, topic, message, kind):
        """What all the others heard, and refused if it is of a kind that is."""
        before = self.refused(kind)
        stray = self.client.create_publisher(topic.type, topic.name, topic.qos)
        # Heard by this client, the recorder, and whoever acts on it.
        reached = HEARD_BY[topic.name]
        assert self.spinner.spin_until(lambda: stray.get_subscription_count() >= reached, LIMIT)
        stray.publish(message)
        assert self.spinner.spin_until(lambda: self.newest[topic.name] == message, LIMIT)
        if kind is not None:
            assert self.spinner.spin_until(lambda: self.more_refused(kind, before), LIMIT)
        try:
            yield
        finally:
            self.client.destroy_publisher(stray)


@contextmanager
def laboratory(bag):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", bag, shortcuts="none", patience=5.0
    )
    rclpy.init()
    executor, nodes = SingleThreadedExecutor(), []
    try:
        nodes.append(client := RunClient(lambda *_: None))
        bench = StrayLaboratory(client, Spinner(executor))
        for name, parameters in node_parameters(settings).items():
            overrides = [Parameter(key, value=value) for key, value in parameters.items()]
            nodes.append(node_class(name)(parameter_overrides=overrides))
        for node in nodes:
            executor.add_node(node)
        assert bench.spinner.spin_until(
            lambda: client.ready(True) and len(bench.newest) == 5, LIMIT
        )
        bench.nodes = nodes
        yield bench
    finally:
        for node in reversed(nodes):
            node.destroy_node()
        executor.shutdown()
        rclpy.shutdown()


def changed(message, **fields):
    message = deepcopy(message)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def stamped(message, sec):
    message = deepcopy(message)
    message.header.stamp.sec = sec
    return message


def spoilt(task):
    """A task whose first object has a feature too many."""
    task = changed(task, episode=task.episode + 1)
    task.initial_state.objects[0].features.append(0.0)
    return task


def unknown_atom(atoms):
    atoms = stamped(atoms, LATEST)
    atoms.atoms[0].predicate = "Levitates"
    return atoms


def of_another_world(_):
    """A simulator that has ended had as many episodes."""
    number = 2 + list(STRAYS).index("fault of another world")
    return EpisodeFault(episode=number, error_code=75)


def not_finite(state):
    state = changed(state, step=state.step + 1)
    state.objects[0].features[0] = float("inf")  # equal to itself
    return state


STRAYS = {
    "nameless domain": (DOMAIN, lambda _: DomainInfo(), "refused_domains"),
    "unknown domain": (DOMAIN, lambda m: changed(m, name="moon"), "refused_domains"),
    "unknown preset": (DOMAIN, lambda m: changed(m, preset="easy"), "refused_domains"),
    "another domain": (DOMAIN, lambda m: changed(m, name="obstacle_tower"), None),
    "task of no domain": (TASK, lambda m: changed(m, domain="", episode=7), "refused_tasks"),
    "task of another domain": (
        TASK,
        lambda m: changed(m, domain="obstacle_tower", episode=7),
        "refused_tasks",
    ),
    "task that cannot be": (TASK, spoilt, "refused_tasks"),
    "state of 2038": (STATE, lambda m: stamped(m, LATEST), None),
    "state of another episode": (STATE, lambda m: changed(stamped(m, LATEST), episode=99), None),
    "state that is none": (STATE, not_finite, None),
    "atoms of 2038": (ATOMS, lambda m: stamped(m, LATEST), None),
    "atoms that are none": (ATOMS, unknown_atom, None),
    "fault of another episode": (FAULT, lambda _: EpisodeFault(episode=99, error_code=75), None),
    "fault of another world": (FAULT, of_another_world, None),
}


def test_strays_are_refused_and_do_not_stick(network, tmp_path):
    """In each episode there is one; the next shows what has stuck."""
    with laboratory(tmp_path / "bag") as bench:
        for number, (topic, made, kind) in enumerate(STRAYS.values()):
            episode = bench.episode_from(seed=number)
            with bench.published(topic, made(bench.newest[topic.name]), kind):
                beside = bench.solve(episode=episode)
                assert beside.success, beside.error_msg
        after = bench.solve(episode=bench.reset(seed=3))
        assert after.success, after.error_msg
        bench.close_bag()
    found = evaluate_bag(tmp_path / "bag")
    assert len(found.runs) == len(STRAYS) + 1
    assert all(run.success for run in found.runs)
    assert "states that are not finite: 1" in found.damage


def test_a_task_is_opened_that_a_refused_one_overtook(network, tmp_path):
    opened = []
    with laboratory(tmp_path / "bag") as bench:
        episode = bench.episode_from(seed=0)
        tracker = EpisodeTracker(
            bench.client,
            lambda _: None,
            lambda episode, _: opened.append(episode.number),
            Refusals(bench.client),
        )
        assert bench.spinner.spin_until(lambda: opened == [episode], LIMIT)
        after = changed(bench.newest[TASK.name], episode=episode + 1)
        for message in (after, spoilt(after)):  # before either is open
            tracker._on_task(message)
        assert tracker.refusal is not None
        assert bench.spinner.spin_until(lambda: len(opened) > 1, LIMIT)
        assert opened == [episode, episode + 1]
        tracker.destroy()


def test_a_world_that_is_reset_twice_at_once_is_perceived(network, tmp_path):
    with laboratory(tmp_path / "bag") as bench:
        nodes = {node.get_name(): node for node in bench.nodes}
        perception = nodes["perception_node"]
        synchronizers = [nodes[name]._synchronizer for name in ("planner_node", "skill_server")]
        trackers = [perception._episodes, *(waiting._episodes for waiting in synchronizers)]
        perceive, observe = Event(), Event()
        for tracker, begin in zip(trackers, (perceive, observe, observe), strict=True):
            tracker._workers.submit(begin.wait)  # so that both tasks are heard before one is open
        try:
            bench.reset(1)
            newest = bench.reset(2)
            assert bench.spinner.spin_until(
                lambda: {tracker._task.episode for tracker in trackers} == {newest}, LIMIT
            )
            assert bench.spinner.spin_until(lambda: len(perception._early) == 2, LIMIT)
            perceive.set()
            assert bench.spinner.spin_until(
                lambda: all(len(waiting._early) == 2 for waiting in synchronizers), LIMIT
            )
        finally:
            perceive.set()
            observe.set()
        assert bench.spinner.spin_until(
            lambda: all(waiting.latest.episode.number == newest for waiting in synchronizers), LIMIT
        )


def test_a_second_simulator_is_named_and_followed_once_the_first_is_gone(network, tmp_path, capfd):
    pytest.importorskip("pybullet")
    with laboratory(tmp_path / "bag") as bench:
        before = bench.refused("refused_tasks")
        other = SimNode(parameter_overrides=[Parameter("domain", value="cluttered_drawer")])
        bench.nodes.append(other)
        bench.spinner.executor.add_node(other)
        assert bench.spinner.spin_until(lambda: bench.more_refused("refused_tasks", before), LIMIT)
        assert "/sim_node and /sim_node publish tasks on this network" in capfd.readouterr().err
        assert bench.solve().success  # the first simulator's task
        first = next(node for node in bench.nodes if isinstance(node, SimNode))
        bench.nodes.remove(first)
        first.destroy_node()
        followed = bench.newest[TASK.name]
        assert followed.domain == "cluttered_drawer"
        assert bench.spinner.spin_until(
            lambda: bench.newest[ATOMS.name].header == followed.header, LIMIT
        )
