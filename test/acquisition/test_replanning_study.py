# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of success with replanning: the figures of `slap evaluate`, for several libraries."""

import json

import pytest

from slap_ros.skills.skill_library import AcquiredSkill
from support.points import HORIZON, PUT, REWARDS
from support.slap_command import slap
from support.steady_skills import PICKING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")

# Lets go as soon as it begins, away from where the object is to be.
DROPPING = AcquiredSkill(PUT, REWARDS["Put"], towards(1, True, gain=0.0), HORIZON)


def ran(*arguments):
    result = slap(*arguments)
    assert result.exit_code in (0, 1), result.output
    return result


def study(tmp_path, *libraries):
    pytest.importorskip("matplotlib")
    given = [word for library in libraries for word in ("--library", library)]
    options = ("--tasks", 2, "--seeds", 2, "--output", tmp_path / "out")
    assert ran("study", "replanning", "points", *given, *options).exit_code == 0
    data = json.loads((tmp_path / "out" / "replanning_points.json").read_text())
    return data["found"]["goals"], (tmp_path / "out" / "replanning_points.md").read_text()


@pytest.mark.slow
def test_figures_are_those_of_the_command(tmp_path):
    library = write_library(tmp_path / "bad", PICKING, DROPPING)
    rows, _ = study(tmp_path, library)
    for row in rows:
        path = tmp_path / f"{row['goal']}.json"
        goal = ("--goal", row["goal"]) if row["goal"] else ()
        options = ("--tasks", 2, "--seeds", 2, "--first-seed", 500, "--output", path)
        ran("evaluate", "points", "--skills", library, *goal, *options)
        (approach,) = json.loads(path.read_text())["approaches"]
        trials = approach["trials"]
        assert row["success_rate"] == approach["success_rate"]
        assert row["success_interval"] == approach["success_interval"]
        assert row["replans"]["mean"] == sum(trial["replans"] for trial in trials) / len(trials)
        assert sum(row["failures"].values()) == sum(not trial["success"] for trial in trials)


@pytest.mark.slow
def test_the_first_library_has_the_tasks_of_all_seeds_and_what_fails_is_said(tmp_path):
    good = write_library(tmp_path / "good")
    bad = write_library(tmp_path / "bad", PICKING, DROPPING)
    rows, page = study(tmp_path, good, bad, good)
    for first, others in zip(rows[::2], rows[1::2], strict=True):
        assert (first["goal"], first["success_rate"], first["failures"]) == (others["goal"], 1, {})
        assert [len(one["tasks"]) for one in first["libraries"]] == [4]
        assert [len(one["tasks"]) for one in others["libraries"]] == [2, 2]
        assert [one["success_rate"] for one in others["libraries"]] == [0.0, 1.0]
        for task in others["libraries"][0]["tasks"]:
            (name,) = others["failures"]
            assert f"; {name}: " in task
    assert "| 2 × 2 | 50% [15%, 85%] |" in page
