# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clocks that are set in the middle of a run: order comes from steps."""

from contextlib import contextmanager

import pytest
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.nodes import RunSettings, node_class, node_parameters
from slap_ros.bags import evaluate_bag
from slap_ros.messages.interfaces import ATOMS, PLAN_EVENT, STATE
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import LIMIT, EnsembleBench, one_executor
from support.clocks import BY_THE_CLOCK, SettableClock

PACE = 40.0  # environment steps per second
DAY = 86_400.0  # s
SET_BY = (-0.3, -3.0, -DAY, 400.0 * DAY)  # s


class ClockLaboratory(EnsembleBench):
    """An ensemble that goes by a clock that can be set."""

    def __init__(self, client, spinner, clock, heard):
        super().__init__(client, spinner)
        self.clock, self.heard = clock, heard

    def of_type(self, type_name, episode):
        return [m for name, m in self.heard if name == type_name and m.episode == episode]

    def solve_while_it_is_set(self, seed, set_by):
        """Set the clock while planning, while executing, and between one run and the next."""
        episode = self.reset(seed)
        sent = self.client.send((), 0, 0, episode)
        self.until(lambda: self.of_type(PLAN_EVENT, episode))
        self.clock.set_by(-set_by)
        self.until(lambda: len(self.of_type(STATE, episode)) > 3)
        self.clock.set_by(2.0 * set_by)
        result = self.result(self.result(sent).get_result_async()).result
        assert result.success, result.error_msg
        self.clock.set_by(-2.0 * set_by)
        return result


@contextmanager
def laboratory(bag):
    """Everything in this process; ``bag`` is recorded."""
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        3,
        0,
        "lazy",
        bag,
        pace=PACE,
        shortcuts="none",
        patience=5.0,
    )
    heard = []
    with one_executor() as (nodes, spinner):
        nodes.append(clock := SettableClock())
        nodes.append(client := RunClient(lambda *message: heard.append(message)))
        for name, parameters in node_parameters(settings).items():
            given = {**parameters, **BY_THE_CLOCK}
            overrides = [Parameter(key, value=value) for key, value in given.items()]
            nodes.append(node_class(name)(parameter_overrides=overrides))
        for node in nodes:
            spinner.executor.add_node(node)
        bench = ClockLaboratory(client, spinner, clock, heard)
        bench.until(lambda: client.ready(True))
        # Perception opens its first episode when the domain is imported; one that was closed by
        # then is not perceived.
        bench.until(lambda: bench.of_type(ATOMS, 1))
        yield bench


@pytest.mark.slow
def test_a_clock_that_is_set_changes_nothing_but_stamps(network, tmp_path):
    with laboratory(tmp_path / "bag") as bench:
        solved = [bench.solve_while_it_is_set(seed, set_by) for seed, set_by in enumerate(SET_BY)]
        bench.close_bag()
    found = evaluate_bag(tmp_path / "bag")
    assert (found.damage, found.mismatches) == (None, [])
    lengths = [run.plan_length for run in found.runs]
    assert all(0.0 < run.planning_seconds < LIMIT for run in found.runs)
    assert lengths == [result.plan_length for result in solved]
    # Nothing was done in the first episode; each has its initial state.
    assert found.compared == sum(lengths) + len(solved) + 1
