# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The main table is what its trials say."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.experiment import Experiment
from support.study_helpers import in_this_process

LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"
NAME = "table1_obstacle2d"


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """The same library twice, as if it had been trained with two seeds."""
    folder = tmp_path_factory.mktemp("trained")
    for seed in "12":
        shutil.copytree(LIBRARY, folder / "obstacle2d" / seed)
    return [folder / "obstacle2d" / seed for seed in "12"]


def table1(output, libraries, *more):
    arguments = ["study", "table1", "obstacle2d", "--output", str(output), "--tasks", "2"]
    arguments += [part for folder in libraries for part in ("--library", str(folder))]
    result = CliRunner().invoke(app, [*arguments, "--seeds", "2", "--samples", "2", *more])
    return result.exit_code, " ".join(result.stderr.split())


def rows(output):
    return json.loads((output / f"{NAME}.json").read_text())["found"]["rows"]


@pytest.fixture(scope="module")
def written(libraries, tmp_path_factory):
    output = tmp_path_factory.mktemp("results")
    with pytest.MonkeyPatch.context() as patch:
        in_this_process(patch)
        code, said = table1(output, libraries)
    assert code == 0, said
    return output


@pytest.mark.slow
def test_figures_are_those_of_the_trials(written):
    found = rows(written)
    assert [(row["preset"], row["approach"]) for row in found] == [
        (preset, approach)
        for preset in ("fair", "paper")
        for approach in ("pure_planning", "shooting", "slap_1_sample", "slap")
    ]
    pure = found[0]["libraries"][0]["trials"]
    for row in found[:4]:
        lengths = [t["plan_length"] for lib in row["libraries"] for t in lib["trials"]]
        assert row["plan_length"]["mean"] == pytest.approx(sum(lengths) / len(lengths))
        share = len(row["libraries"]) * sum(t["plan_length"] for t in pure)
        assert row["relative_length"] == pytest.approx(sum(lengths) / share)
        assert len(lengths) == len(row["libraries"]) * row["tasks"]
    # Nothing is learned in a search: libraries with the same signatures share it.
    assert [len(row["libraries"]) for row in found[:4]] == [1, 1, 2, 2]
    assert {(t["seed"], t["index"]) for t in pure} == {(500, 0), (500, 1), (501, 0), (501, 1)}


def test_equal_tasks_count_once():
    experiment = Experiment(get_domain("obstacle2d", "paper"), 10, 2).without_repetitions()
    starts = {experiment.domain.task(*which).initial_state.key for which in experiment}
    assert len(experiment) == len(list(experiment)) == len(starts) == 3


def test_a_library_of_another_domain(tmp_path):
    result = CliRunner().invoke(
        app,
        ["study", "table1", "obstacle_tower", "--library", str(LIBRARY), "--output", str(tmp_path)],
    )
    assert result.exit_code == ErrorCode.INVALID_LIBRARY
    assert "obstacle2d" in result.stderr
