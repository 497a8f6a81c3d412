# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages of others on the topics of an ensemble: refused, counted, and without consequence."""

from copy import deepcopy
from threading import Event

import pytest
from rclpy.parameter import Parameter
from slap_msgs.msg import DomainInfo, EpisodeFault

from ensemble.episode_tracker import EpisodeTracker
from ensemble.interfaces import ATOMS, DOMAIN, FAULT, STATE, TASK
from ensemble.refusals import Refusals
from sim_node.node import SimNode
from slap_ros.bags import evaluate_bag
from support.flood import changed
from support.stray_laboratory import laboratory

pytestmark = pytest.mark.timeout(180)  # an ensemble is heard of in heartbeats alone
LATEST = 2**31 - 1  # s since the epoch, in 2038: the last that a stamp can have


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


@pytest.mark.slow
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
        bench.until(lambda: opened == [episode])
        after = changed(bench.newest[TASK.name], episode=episode + 1)
        for message in (after, spoilt(after)):  # before either is open
            tracker._on_task(message)
        assert tracker.refusal is not None
        bench.until(lambda: len(opened) > 1)
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
            bench.until(lambda: {tracker._task.episode for tracker in trackers} == {newest})
            bench.until(lambda: len(perception._early) == 2)
            perceive.set()
            bench.until(lambda: all(len(waiting._early) == 2 for waiting in synchronizers))
        finally:
            perceive.set()
            observe.set()
        bench.until(
            lambda: all(waiting.latest.episode.number == newest for waiting in synchronizers)
        )


def test_a_second_simulator_is_named_and_followed_once_the_first_is_gone(network, tmp_path, capfd):
    pytest.importorskip("pybullet")
    with laboratory(tmp_path / "bag") as bench:
        before = bench.refused("refused_tasks")
        other = SimNode(parameter_overrides=[Parameter("domain", value="cluttered_drawer")])
        bench.nodes.append(other)
        bench.spinner.executor.add_node(other)
        bench.until(lambda: bench.more_refused("refused_tasks", before))
        assert "/sim_node and /sim_node publish tasks on this network" in capfd.readouterr().err
        assert bench.solve().success  # the first simulator's task
        first = next(node for node in bench.nodes if isinstance(node, SimNode))
        bench.nodes.remove(first)
        first.destroy_node()
        followed = bench.newest[TASK.name]
        assert followed.domain == "cluttered_drawer"
        bench.until(lambda: bench.newest[ATOMS.name].header == followed.header)
