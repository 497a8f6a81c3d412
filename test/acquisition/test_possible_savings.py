# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of what shortcuts over acquired skills could save, on the toy domain."""

import json

import pytest

from slap_ros.errors import ErrorCode
from support.slap_command import slap
from support.steady_skills import PICKING, write_library

pytest.importorskip("matplotlib")
pytestmark = pytest.mark.usefixtures("points_installed")


def study(*arguments):
    command = ["study", "possible_savings", "points", "--preset", "line", *arguments]
    return slap(*command)


def test_what_a_push_can_save_is_found_and_within_its_bound(tmp_path):
    skills = write_library(tmp_path / "steady")
    ran = study("--skills", skills, "--tasks", 2, "--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    data = json.loads((tmp_path / "out" / "possible_savings_points.json").read_text())
    assert data["skills"]["name"] == "steady"
    (row,) = data["found"]["rows"]
    assert row["replaced"] == ["Pick", "Put"] and row["shares"] == [1.0, 1.0]
    assert row["most_steps"] == pytest.approx(0.9 * row["steps"])
    assert row["found"] == 2
    for task in data["found"]["tasks"]:
        (saving,) = task["savings"]
        assert 0.0 < saving["found"] < saving["saving"] == task["plan"]
    page = (tmp_path / "out" / "possible_savings_points.md").read_text()
    assert "| Pick, Put | 2 | 100% |" in page and "2 tasks" in page


def test_skills_that_lead_to_no_goal_leave_nothing_to_bound(tmp_path):
    half = write_library(tmp_path / "half", PICKING)
    ran = study("--skills", half, "--tasks", 1, "--output", tmp_path / "out")
    assert ran.exit_code == ErrorCode.UNSOLVABLE
    assert "none of the 1 tasks has a plan" in " ".join(ran.stderr.split())
    assert not list((tmp_path / "out").glob("*.md"))
