# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain whose code raises ends the episode with that, and nothing else."""

import sys

import pytest

from ensemble.client import RunClient
from ensemble.interfaces import FAULT
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.bags import evaluate_bag
from slap_ros.errors import ErrorCode
from slap_ros.messages.interfaces import STATE
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import EnsembleBench

FRAGILE = """
from dataclasses import replace
from slap_ros.domains import get_domain

BROKEN = ""  # what raises from now on


def broken(part):
    if part == BROKEN:
        raise ZeroDivisionError(f"{part} divides by zero")


class FragileWorld:
    def __init__(self, world):
        self._world = world

    def step(self, action):
        broken("step")
        return self._world.step(action)

    def __getattr__(self, name):
        return getattr(self._world, name)


def make():
    made = get_domain("obstacle2d")

    def fragile(predicate):
        part = "static predicate" if predicate in made.static_predicates else "predicate"

        def classifier(*arguments):
            broken(part)
            return predicate.classifier(*arguments)

        return replace(predicate, classifier=classifier)

    def bodies(state):
        broken("bodies")
        return made.display.bodies(state)

    return replace(
        made, name="fragile", preset="default",
        make_world=lambda state: FragileWorld(made.make_world(state)),
        predicates=tuple(map(fragile, made.predicates)),
        display=replace(made.display, bodies=bodies),
    )
"""


class FragileEnsemble(EnsembleBench):
    """An ensemble in this process whose domain may break, and a client."""

    def __init__(self, client, spinner, heard):
        super().__init__(client, spinner)
        self.heard = heard

    def states(self, episode):
        return [m for kind, m in self.heard if kind == STATE and m.episode == episode]

    def solve_breaking(self, episode, part):
        """The result; ``part`` of the domain breaks once the plan is under way."""
        sent = self.client.send((), 0, 2, episode)
        self.until(lambda: len(self.states(episode)) > 3)
        sys.modules["fragile_domain"].BROKEN = part
        result = self.result(self.result(sent).get_result_async()).result
        sys.modules["fragile_domain"].BROKEN = ""
        return result


@pytest.fixture
def bench(network, install_domain, tmp_path):
    settings = RunSettings(
        DomainChoice(install_domain("fragile", FRAGILE), "default"), 3, 0, "lazy", tmp_path / "bag",
        pace=50.0, shortcuts="none", patience=5.0,
    )  # fmt: skip
    nodes = node_parameters(settings)
    # What never comes is waited for less long than in a laboratory.
    nodes["planner_node"] = {**nodes["planner_node"], "observation_timeout": 1.0}
    heard = []
    with (
        temporary_node(lambda: RunClient(lambda *message: heard.append(message), (FAULT,))) as (
            client,
            spinner,
        ),
        InProcessLauncher(nodes, spinner.executor),
    ):
        made = FragileEnsemble(client, spinner, heard)
        made.until(lambda: client.ready(True) and made.states(1))
        yield made


@pytest.mark.parametrize("part", ["step", "predicate"])
def test_an_error_of_a_domain_ends_the_episode_with_its_name(bench, tmp_path, part):
    failed = bench.solve_breaking(1, part)
    assert failed.error_code == ErrorCode.INVALID_DOMAIN
    for words in ("domain fragile raised ZeroDivisionError", f"{part} divides by zero"):
        assert words in failed.error_msg
    again = bench.solve(1)  # the episode is over, though nothing is broken any more
    assert again.error_code == ErrorCode.INVALID_DOMAIN
    assert bench.solve(bench.reset(seed=4)).success  # every node has lived on
    bench.close_bag()
    found = evaluate_bag(tmp_path / "bag")
    assert found.damage is None
    assert [run.error_code for run in found.runs] == [failed.error_code, again.error_code, 0]
    assert any(kind == FAULT.type_name for kind, _ in bench.heard)


def test_what_cannot_be_shown_is_not_missed_and_said_once(bench, capfd):
    assert bench.solve_breaking(1, "bodies").success
    told = capfd.readouterr().err
    assert told.count("not shown: domain fragile raised ZeroDivisionError") == 1
    assert told.count("Traceback") == 1


@pytest.mark.parametrize("part", ["predicate", "static predicate"])
def test_a_task_that_cannot_be_perceived_is_no_silence(bench, part):
    assert bench.solve(1).success
    sys.modules["fragile_domain"].BROKEN = part
    failed = bench.solve(bench.reset(seed=4))
    sys.modules["fragile_domain"].BROKEN = ""
    assert failed.error_code == ErrorCode.INVALID_DOMAIN
    assert f"{part} divides by zero" in failed.error_msg
    assert bench.solve(bench.reset(seed=4)).success
