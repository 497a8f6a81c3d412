# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of task progress: several libraries, a skill that is lacking, and none that ships."""

import json

import pytest

from slap_ros.policies import shipped_models
from slap_ros.skills.skill_library import AcquiredSkill
from support.points import HORIZON, PUT, REWARDS
from support.slap_command import slap
from support.steady_skills import PICKING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")


def study(*arguments):
    pytest.importorskip("matplotlib")
    command = ["study", "acquisition", "points", *arguments]
    return slap(*command)


def test_progress_is_the_share_of_stages_that_were_done(tmp_path):
    good = write_library(tmp_path / "good")
    never = AcquiredSkill(PUT, REWARDS["Put"], towards(1, False), HORIZON)  # lets go of nothing
    bad = write_library(tmp_path / "bad", PICKING, never)
    ran = study("--library", good, "--library", bad, "--tasks", 3, "--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    data = json.loads((tmp_path / "out" / "acquisition_points.json").read_text())
    for goal in data["found"]["goals"]:
        whole, half = goal["libraries"]
        assert (whole["progress"], whole["failures"]) == (1.0, {})
        stages = [len(task["stages"]) for task in whole["tasks"]]
        assert half["progress"] == pytest.approx(sum(1 / n for n in stages) / len(stages))
        assert half["failures"] == {"Put": 3}
        assert goal["progress"]["mean"] == pytest.approx((1.0 + half["progress"]) / 2)


def test_without_a_library_that_ships_it_says_what_to_give(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped_models, "model_roots", lambda: iter([tmp_path]))
    ran = study("--output", tmp_path)
    assert ran.exit_code != 0
    assert "slap acquire points" in " ".join(ran.stderr.split())


def test_libraries_of_other_rewards_are_a_row_of_their_own(tmp_path):
    manual, composed = write_library(tmp_path / "manual"), write_library(tmp_path / "composed")
    record = json.loads((composed / "library.json").read_text())
    (composed / "library.json").write_text(json.dumps(record | {"rewarder": "composed"}))
    ran = study(
        *("--library", manual, "--library", composed, "--tasks", 1, "--output", tmp_path / "out")
    )
    assert ran.exit_code == 0, ran.output
    rows = json.loads((tmp_path / "out" / "acquisition_points.json").read_text())["found"]["goals"]
    assert [row["rewarder"] for row in rows] == ["manual", "composed"] * (len(rows) // 2)
    assert "| manual, composed |" in (tmp_path / "out" / "acquisition_points.md").read_text()
