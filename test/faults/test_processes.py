# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that are killed, stopped, paused or started again: nothing hangs, nothing is lost."""

import signal
from contextlib import ExitStack, contextmanager

import pytest
import rclpy
from process_faults import LIMIT, RUNNER, Run, recorded
from rclpy.executors import SingleThreadedExecutor
from slap_msgs.srv import ResetTask

from ensemble.client import RunClient
from ensemble.hosts import ProcessHost
from ensemble.interfaces import ATOMS, PLAN_EVENTS, RESET_TASK, SKILL_EVENTS, STATE
from ensemble.nodes import RunSettings, node_parameters
from ensemble.presence import Presence
from ensemble.run import Spinner
from slap_ros.bags import evaluate_bag
from slap_ros.errors import ErrorCode


@pytest.mark.timeout(3 * LIMIT)
def test_a_run_ends_in_success_or_in_an_error_and_leaves_its_bag(network, tmp_path, process_case):
    run = Run(process_case, tmp_path / "bag")
    try:
        run.strike()
        code, said = run.ended()
        assert run.orphans() == []
    finally:
        run.clean_up()
    if process_case.victim == RUNNER and process_case.fault == "kill":
        assert code in (-signal.SIGKILL, 0)
    else:
        assert code >= 0 and ErrorCode(code) is not ErrorCode.UNKNOWN, said
    assert "Traceback" not in said
    print(process_case, "ended with", code)  # noqa: T201
    if recorded(run.bag) > 10_000:  # more than the description of the domain
        assert evaluate_bag(run.bag).states > 0


# By which a node is told from its successor.
PUBLISHED = {
    "sim_node": STATE,
    "perception_node": ATOMS,
    "skill_server": SKILL_EVENTS,
    "planner_node": PLAN_EVENTS,
}


class Laboratory:
    """An ensemble whose nodes come and go, and a client."""

    def __init__(self, nodes, client, spinner):
        self.nodes, self.client, self.spinner = nodes, client, spinner
        self._hosts = {}

    def start(self, name, **changed):
        self._hosts[name] = ProcessHost({name: {**self.nodes[name], **changed}})
        self._hosts[name].__enter__()

    def restart(self, name, **changed):
        """Kill it, start it again, and wait until nobody takes it for its predecessor."""
        old = Presence(self.client, PUBLISHED[name]) if name in PUBLISHED else None
        process = self._hosts[name].processes[name]
        process.kill()
        process.wait()
        if old is None:
            self.until(lambda: name not in self.client.others())
        self.start(name, **changed)
        self.until(lambda: (old is None or old.gone()) and self.client.ready(True))

    def stop(self):
        for host in self._hosts.values():
            host.__exit__(None, None, None)

    def until(self, condition):
        assert self.spinner.until(condition, LIMIT), "hung"

    def ask(self, episode=0):
        """Ask for the task to be solved; the future result."""
        sent = self.client.send((), 0, 2, episode)
        self.until(sent.done)
        return sent.result().get_result_async()

    def reset(self, seed):
        service = self.client.create_client(RESET_TASK.type, RESET_TASK.name)
        self.until(service.service_is_ready)
        answer = service.call_async(ResetTask.Request(seed=seed))
        self.until(answer.done)
        self.client.destroy_client(service)
        return answer.result().episode


@contextmanager
def laboratory(case, bag):
    settings = RunSettings(
        "obstacle2d", "fair", case.seed % 50, 0, "lazy", bag, pace=20.0, shortcuts="none"
    )
    with ExitStack() as stack:
        rclpy.init()
        stack.callback(rclpy.shutdown)
        executor = SingleThreadedExecutor()
        stack.callback(executor.shutdown)
        client = RunClient(lambda *_: None)
        stack.callback(client.destroy_node)
        executor.add_node(client)
        bench = Laboratory(node_parameters(settings), client, Spinner(executor))
        stack.callback(bench.stop)
        for name in bench.nodes:
            bench.start(name)
        bench.until(lambda: client.ready(True))
        yield bench


@pytest.mark.timeout(5 * LIMIT)
def test_a_node_started_again_is_taken_up_again(network, tmp_path, restart_case):
    victim, bags = restart_case.victim, [tmp_path / "bag", tmp_path / "next"]
    with laboratory(restart_case, bags[0]) as bench:
        result = bench.ask()
        bench.until(lambda: recorded(bags[0]) >= restart_case.bag_size or result.done())
        bench.restart(victim, **({"bag": str(bags[1])} if victim == "recorder_node" else {}))
        if victim != "planner_node":  # whose answer died with it
            bench.until(result.done)
            told = result.result().result
            assert told.success != bool(told.error_code)
            assert ErrorCode(told.error_code) is not ErrorCode.UNKNOWN, told.error_msg
        solved = solve_anew(bench, restart_case.seed + 1)
        assert solved.success, solved.error_msg
        bench.until(bench.client.close_bag().done)
    for bag in bags if victim == "recorder_node" else bags[:1]:
        found = evaluate_bag(bag)
        assert found.states > 0
    assert found.runs[-1].success


def solve_anew(bench, seed):
    """A new episode solved; again while the ensemble still finds out who is gone."""
    for attempt in range(4):
        ended = bench.ask(bench.reset(seed + attempt))
        bench.until(ended.done)
        result = ended.result().result
        if result.success:
            break
    return result
