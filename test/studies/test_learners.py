# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries of the same learner share a row, and their record says which learner it was."""

import json
import shutil
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.studies.slap.learners import learner_of
from support.slap_command import slap

LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"


def learners(domain, output, folders):
    arguments = ["study", "learners", domain, "--output", str(output), "--tasks", "2"]
    arguments += [part for folder in folders for part in ("--library", str(folder))]
    result = slap(*arguments, "--seeds", "1", "--samples", "2")
    return result.exit_code, " ".join(result.stderr.split())


def copied(folder, settings):
    """The library of the tests, as if these settings had made it."""
    shutil.copytree(LIBRARY, folder)
    about = json.loads((folder / "library.json").read_text())
    about["settings"] = settings
    (folder / "library.json").write_text(json.dumps(about))
    return folder


def test_a_learner_has_a_row_with_all_its_libraries(tmp_path):
    folders = [
        copied(tmp_path / "independent", {}),
        copied(tmp_path / "subgoals0", {"together": 4}),
        copied(tmp_path / "subgoals1", {"together": 4}),
    ]
    code, said = learners("obstacle2d", tmp_path, folders)
    assert code == 0, said
    data = json.loads((tmp_path / "learners_obstacle2d.json").read_text())
    rows = {row["approach"]: row for row in data["found"]["rows"]}
    assert list(rows) == ["pure_planning", "independent_ppo", "subgoals"]
    assert [len(row["libraries"]) for row in rows.values()] == [1, 1, 2]
    assert rows["subgoals"]["kept"] == [1, 1]
    for row in rows.values():
        lengths = [t["plan_length"] for one in row["libraries"] for t in one["trials"]]
        assert row["plan_length"]["mean"] == pytest.approx(sum(lengths) / len(lengths))
    assert rows["independent_ppo"]["plan_length"] == rows["subgoals"]["plan_length"]
    assert "Abstract Subgoals" in (tmp_path / "learners_obstacle2d.md").read_text()


@pytest.mark.parametrize(
    ("settings", "learner"),
    [
        ({}, "independent_ppo"),
        ({"sac": {"hindsight": 0.0}}, "independent_sac"),
        ({"together": 3}, "subgoals"),
        ({"together": 3, "sac": {"hindsight": 0.0}}, "subgoals_sac"),
        ({"together": 3, "sac": {"hindsight": 0.9}}, "abstract_her"),
    ],
)
def test_settings_say_who_learned(settings, learner):
    assert learner_of({"settings": settings}) == learner


def test_without_a_library_there_is_nothing_to_compare(tmp_path):
    code, said = learners("bowls", tmp_path, [])
    assert code == ErrorCode.INVALID_PARAMETER
    assert "slap train bowls --settings subgoals" in said
    assert not list(tmp_path.iterdir())
