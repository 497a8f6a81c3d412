# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills in closed loop in another physics: the contact world beside arms of any stiffness."""

import json
import sys
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode
from support.slap_command import slap

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")


def study(domain, output, *more):
    small = ["--tasks", "1", "--seed", "304"]
    return slap("study", "closed_loop", domain, "--output", output, *small, *more)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--stiffness", "0"], "stiffness of an arm's motors is 0.0"),
        (["--impedance", "-1"], "stiffness of a hand's impedance is -1.0"),
        (["--stiffness", "1", "--lag", "-1"], "lag_s of an arm's motors is -1.0"),
    ],
)
def test_an_arm_that_there_is_not_is_refused(tmp_path, more, said):
    done = study("stack_at_target", tmp_path, *more)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert said in " ".join(done.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_domain_without_forces_is_sent_to_its_own_study(tmp_path):
    done = study("obstacle_tower", tmp_path)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert "slap study transfer obstacle_tower" in " ".join(done.stderr.split())


def test_without_the_extra_nothing_is_solved(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = study("stack_at_target", tmp_path)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert "slap_ros[mujoco]" in " ".join(done.stderr.split())


def test_the_contact_world_and_each_arm_have_a_row_for_all_skills(tmp_path):
    more = ["--goal", "training", "--impedance", "2000", "--stiffness", "4"]
    done = study("stack_at_target", tmp_path, *more)
    assert done.exit_code == 0, done.stderr
    data = json.loads((tmp_path / "closed_loop_stack_at_target.json").read_text())
    rows = data["found"]["rows"]
    arms = [(row["impedance"], row["stiffness"]) for row in rows]
    assert arms == [(None, None), (2000.0, None), (None, 4.0)] * 2
    assert [row["skills"] for row in rows] == ["manual, manual, seed 0"] * 3 + ["demonstrator"] * 3
    scripts = [row["trials"][0] for row in rows[3:]]
    assert all(trial["success"] for trial in scripts)
    lengths = [trial["plan_length"] for trial in scripts]
    assert lengths[0] < lengths[1] < lengths[2]  # what lags is later
    page = (tmp_path / "closed_loop_stack_at_target.md").read_text()
    assert "| training | demonstrator | × 4 | 1 of 1 " in page
    assert "| training | demonstrator | 2000 N/m | 1 of 1 " in page
    assert "| training | demonstrator | contact world | 1 of 1 " in page


@pytest.mark.slow
def test_shortcuts_over_skills_have_rows_of_their_own_and_save_steps(tmp_path):
    join = Path(__file__).parents[2] / "models" / "join"
    more = ["--preset", "fair:blocked=1", "--goal", "training", "--stiffness", "10"]
    folders = ["--library", join / "skills", "--shortcuts", join / "shortcuts"]
    done = study("stack_at_target", tmp_path, *more, *folders)
    assert done.exit_code == 0, done.stderr
    data = json.loads((tmp_path / "closed_loop_stack_at_target.json").read_text())
    skills, _, slap_, *_ = (row["trials"][0] for row in data["found"]["rows"])
    assert skills["success"] and slap_["success"]
    assert slap_["plan_length"] < skills["plan_length"]
    assert f"--shortcuts {join / 'shortcuts'}" in data["command"]


def test_shortcuts_over_other_skills_are_refused(tmp_path):
    shortcuts = Path(__file__).parents[2] / "models" / "join" / "shortcuts"
    done = study("stack_at_target", tmp_path, "--shortcuts", shortcuts)
    assert done.exit_code == ErrorCode.SKILLS_CHANGED
    assert not list(tmp_path.iterdir())
