# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What ``slap evaluate --output`` writes is every trial, and replaces nothing but itself."""

import json
import shlex
from dataclasses import asdict
from pathlib import Path

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.experiment import Trial
from slap_ros.planning.execution import EpisodeResult, ExecutedEdge, PlanExecution
from slap_ros.planning.options import hold_option
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult
from support.marks import slow
from support.slap_command import slap

LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"
COMMAND = ["evaluate", "obstacle2d", "--tasks", "2", "--seeds", "2", "--first-seed", "500"]
WITH = ["--shortcuts", str(LIBRARY), "--samples", "2"]


def evaluate(file, *options):
    result = slap(*COMMAND, *options, "--output", file)
    return result.exit_code, " ".join(result.stderr.split())


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("evaluation") / "data.json"
    code, said = evaluate(path, *WITH)
    assert code == 0, said
    return path


@pytest.mark.slow
def test_the_figures_are_those_of_the_trials(file):
    data = json.loads(file.read_text())
    for row in data["approaches"]:
        trials = row["trials"]
        assert [(t["seed"], t["index"]) for t in trials] == [(500, 0), (500, 1), (501, 0), (501, 1)]
        lengths = [t["plan_length"] for t in trials if t["success"]]
        assert row["plan_length"]["mean"] == pytest.approx(sum(lengths) / len(lengths))
        for trial in trials:
            assert sum(edge["steps"] for edge in trial["edges"]) == trial["plan_length"]
            learned = [e["steps"] for e in trial["edges"] if e.get("kind") == "shortcut"]
            assert sum(learned) == trial["shortcut_steps"]
    assert data["library"]["name"] == "obstacle2d"


@pytest.mark.parametrize("more", [[], *slow(["--shooting"])])
def test_its_command_makes_it_again(file, tmp_path, more):
    if more:
        file = tmp_path / "data.json"
        code, said = evaluate(file, *WITH, *more)
        assert code == 0, said
    command = json.loads(file.read_text())["command"]
    assert [option for option in more if option not in shlex.split(command)] == []
    again = tmp_path / "again.json"
    arguments = [*shlex.split(command)[1:], "--output", str(again)]
    assert slap(*arguments).exit_code == 0

    def rows(path):
        return [
            [{k: v for k, v in t.items() if k != "planning_seconds"} for t in row["trials"]]
            for row in json.loads(path.read_text())["approaches"]
        ]

    assert rows(again) == rows(file)


def test_an_edge_says_only_what_is_not_true_of_most():
    edges = (
        ExecutedEdge("PickUp", ("robot", "block0"), "operator", 7, True),
        ExecutedEdge("push", ("block0", "target"), "shortcut", 5, True),
        ExecutedEdge("PutDown", ("robot", "block0"), "operator", 3, False),
    )
    trial = Trial(500, 0, False, 15, 5, 0.25, 9, "stopped short", edges=edges)
    data = trial.as_json()
    assert [edge.get("kind", "given") for edge in data["edges"]] == ["given", "shortcut", "given"]
    assert [edge.get("reached", "so") for edge in data["edges"]] == ["so", "so", False]
    assert Trial.from_json(json.loads(json.dumps(data))) == trial
    assert Trial.from_json(json.loads(json.dumps(asdict(trial)))) == trial  # of earlier versions
    del data["bound"]  # which came later still
    assert Trial.from_json(data) == trial


def test_a_bound_is_that_of_the_first_plan_to_the_last_digit():
    planned = [PlanningResult(Plan(()), 1, 0, 0), PlanningResult(a_step(159), 1, 1, 1, at_least=39)]
    tried = [PlanExecution(0, one) for one in (None, planned[1], planned[0])]  # first: no plan
    data = json.loads(json.dumps(Trial.of(500, 0, EpisodeResult(plans=tried)).as_json()))
    assert data["bound"] == 159 / 39
    assert Trial.of(500, 0, EpisodeResult(plans=tried[:1])).bound is None


def a_step(steps):
    hold = hold_option(get_domain("obstacle2d").action_space)
    return Plan((PlanEdge(hold, hold.target(0), steps),))


def test_the_data_of_another_command_stays(file):
    before = file.read_bytes()
    code, said = evaluate(file, "--shortcuts", "none")
    assert code == ErrorCode.INVALID_PARAMETER
    assert "has the data of `slap evaluate obstacle2d" in said
    assert file.read_bytes() == before


def test_a_search_without_learning_needs_a_library_all_the_same(tmp_path):
    code, said = evaluate(tmp_path / "data.json", "--shooting", "--shortcuts", "none")
    assert code == ErrorCode.INVALID_PARAMETER
    assert "give --shortcuts" in said
    assert not list(tmp_path.iterdir())


def test_what_is_no_evaluation_stays(tmp_path):
    other = tmp_path / "notes.json"
    other.write_text("{}")
    code, said = evaluate(other)
    assert code == ErrorCode.INVALID_PARAMETER
    assert "is no evaluation" in said
    assert other.read_text() == "{}"
