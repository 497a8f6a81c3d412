# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stranger who never stops publishing: runs succeed beside it, and nodes do not grow."""

import os
import subprocess
from contextlib import contextmanager

import psutil
import pytest
from slap_msgs.msg import AbstractState, ObjectCentricState, ObjectState, PlanEvent

from ensemble.domain_announcements import DomainAnnouncements
from ensemble.early_messages import EarlyMessages
from ensemble.interfaces import ATOMS, COMMAND, DOMAIN, FAULT, PLAN_EVENTS, SKILLS, STATE, TASK
from ensemble.next_states import AHEAD, NextStates
from ensemble.waiting_room import NUMBERS, WaitingRoom, key_of
from slap_ros.bags import read_bag
from slap_ros.skills.domain_choice import DomainChoice
from support.flood import KINDS
from support.living_ensemble import laboratory
from support.process_faults import LIMIT
from support.programs import PATH, program
from support.stray_laboratory import laboratory as laboratory_in_process

BURST = 120  # messages of a stranger between two of this process' turns, every PERIOD
PERIOD = 0.03  # s
RATE = 1000  # messages of a stranger per second
GROWTH = 80e6  # bytes that a node may grow by beside it: its own libraries are among them
QUICK = ("state of a later step", "unknown domain", "task of another domain")


def listeners(nodes):
    """The callbacks that a message of each topic reaches, by the topic's name."""
    named = {node.get_name(): node for node in nodes}
    perception, world = named["perception_node"], named["sim_node"]
    pairing = [named[name]._synchronizer for name in ("planner_node", "skill_server")]
    trackers = [perception._episodes, *(one._episodes for one in pairing)]
    return {
        STATE.name: [perception._on_state, *(one._on_state for one in pairing)],
        ATOMS.name: [one._on_atoms for one in pairing],
        FAULT.name: [one._on_fault for one in pairing],
        DOMAIN.name: [one._on_domain for one in trackers],
        TASK.name: [one._on_task for one in trackers],
        SKILLS.name: [world._on_skills, *(one._on_skills for one in trackers)],
        COMMAND.name: [world._on_command],
    }


@contextmanager
def strangers(bench, kind):
    """Many messages of a kind reach every node between any two that belong there."""
    topic, made = KINDS[kind]
    callbacks, made_for = listeners(bench.nodes)[topic.name], {}

    def burst():
        episode = bench.newest[TASK.name].episode
        if episode not in made_for:
            made_for[episode] = [made(bench.newest, number) for number in range(BURST)]
        for callback in callbacks:
            for message in made_for[episode]:
                callback(message)

    timer = bench.client.create_timer(PERIOD, burst)
    yield
    bench.client.destroy_timer(timer)


@pytest.mark.timeout(180)  # six runs, each with bursts of messages between its steps
def test_a_run_and_the_next_one_succeed_among_messages_of_strangers(network, tmp_path):
    with laboratory_in_process(tmp_path / "bag") as bench:
        episode = bench.episode_from(seed=3)
        for number, kind in enumerate(QUICK):
            with strangers(bench, kind):
                beside = bench.solve(episode=episode)
                assert beside.success, (kind, beside.error_msg)
                episode = bench.reset(seed=number)
                following = bench.solve(episode=episode)
                assert following.success, (kind, following.error_msg)
            episode = bench.episode_from(seed=3)


@pytest.mark.slow
@pytest.mark.timeout(4 * LIMIT)  # three runs, each beside 1,000 messages a second
def test_runs_succeed_beside_a_flood_and_nodes_do_not_grow(network, tmp_path, flood_kind):
    bag, said = tmp_path / "bag", tmp_path / "flood.txt"
    with laboratory(3, bag, 0.0, patience=20.0) as bench:
        bench.until(lambda: bench.told("slap_msgs/msg/AbstractState"))
        before = memory(bench)
        command = [*program("flood"), flood_kind, str(RATE)]
        with said.open("w") as file:
            flood = subprocess.Popen(
                command, env=os.environ | {"PYTHONPATH": PATH}, stdout=file, stderr=file
            )
        try:
            bench.until(lambda: "flooding" in said.read_text())
            for seed in (None, 5, 6):
                episode = 0 if seed is None else bench.reset(seed)
                asked = bench.ask(episode)
                bench.until(asked.done)
                assert asked.result().result.success, asked.result().result.error_msg
            assert flood.poll() is None, said.read_text()
            after = memory(bench)
            closed = bench.client.close_bag()
            bench.until(closed.done)
        finally:
            flood.kill()
            flood.wait()
    assert all(after[name] < before[name] + GROWTH for name in after), (before, after)
    solved = [item for item in read_bag(bag) if item.type_name == PLAN_EVENTS.type_name]
    assert sum(item.message.kind == PlanEvent.SOLVED for item in solved) == 3


def memory(bench):
    """Bytes that each node has."""
    processes = {name: one.processes[name].pid for name, one in bench._launchers.items()}
    return {name: psutil.Process(pid).memory_info().rss for name, pid in processes.items()}


def state(episode, step, size=1, stamp=0):
    message = ObjectCentricState(episode=episode, step=step)
    message.header.stamp.nanosec = stamp
    message.objects = [ObjectState(name="block", features=[0.0] * size)]
    return message


def test_a_room_is_bounded_in_numbers_and_keeps_the_next_step():
    room = WaitingRoom(100)
    urgent = state(1, 7)
    room.add(urgent)
    for number in range(1000):
        room.add(state(1, 8 + number, stamp=number))
        room.add(AbstractState(episode=1, step=900))
    assert len(room) == 100
    assert room.pop(key_of(urgent)) is urgent
    for number in range(10):
        room.add(state(1, 8 + number, size=NUMBERS // 3))
    assert len(room) <= 3
    wordy = state(1, 8)
    wordy.objects[0].name = "b" * 8 * NUMBERS
    room.add(wordy)  # is too large to be kept at all
    assert room.pop(key_of(wordy)) is None
    room.drop_through(10**6)
    assert len(room) == 0


def test_early_messages_of_strangers_do_not_take_the_room_of_those_that_are_expected():
    early = EarlyMessages(100, lambda message: message, lambda message: message.episode == 2)
    early.add(state(2, 1))
    for number in range(1000):
        early.add(state(1000 + number, 1))
    for _ in range(30):
        early.add(state(1, 1, size=NUMBERS // 10))
    assert len(early) <= 1 + 10
    assert [message.episode for message in early._expected] == [2]


def test_states_are_given_in_order_whatever_claims_to_be_later():
    states, given = NextStates(0), []
    for step in (3, 10**6, 1, 0, 2, 10**6 + 1, 1):
        states.add(state(1, step))
        while (message := states.pop()) is not None:
            given.append(message.step)
            states.step = message.step + 1
    assert given == [0, 1, 2, 3]
    for step in range(10 * AHEAD):
        states.add(state(1, 10**6 + step))
    assert len(states._ahead) == AHEAD


def test_the_domain_of_a_task_is_the_one_with_its_stamp():
    announced, real = DomainAnnouncements(limit=10), DomainChoice("obstacle2d", "fair")
    announced.add(real, 5)
    for number in range(1000):
        announced.add(DomainChoice("obstacle2d", f"fair:blocks={number}"), 6 + number)
        announced.trim(used=real)
    assert announced.candidates("obstacle2d", 5) == [real]
    assert real not in announced.candidates("obstacle2d", 7)
    assert len(announced._stamps) == 10
    assert not announced.add(real, 5)  # latched: sent again
