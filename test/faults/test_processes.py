# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that are killed, stopped, paused or started again: nothing hangs, nothing is lost."""

import signal

import pytest

from slap_ros.bags import evaluate_bag, read_bag
from slap_ros.errors import ErrorCode
from slap_ros.messages.interfaces import STATE
from support.living_ensemble import laboratory
from support.process_faults import LIMIT, RUNNER, Run, recorded

PACE = 20.0  # environment steps a second, so that there is a middle of a run


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
    # More than the description of the domain; where the simulator had a turn, a state too.
    if recorded(run.bag) > 10_000 and any(m.type_name == STATE for m in read_bag(run.bag)):
        assert evaluate_bag(run.bag).states > 0


@pytest.mark.timeout(5 * LIMIT)
def test_a_node_started_again_is_taken_up_again(network, tmp_path, restart_case):
    victim, bags = restart_case.victim, [tmp_path / "bag", tmp_path / "next"]
    with laboratory(restart_case.seed, bags[0], PACE) as bench:
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
