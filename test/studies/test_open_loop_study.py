# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans played open loop in another physics: what counts as solved, and what of the rest."""

import json
import sys

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.studies.lg_sail.domain_choices import shipped_skills, with_demonstrator
from slap_ros.studies.lg_sail.open_loop import OpenLoopTrial, PlayedSkills, play_task
from support.slap_command import slap

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")


def study(domain, output, *more):
    small = ["--tasks", "1", "--seed", "300", "--goal", "training"]
    return slap("study", "open_loop", domain, "--output", output, *small, *more)


def test_without_the_extra_nothing_is_played(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = study("stack_at_target", tmp_path)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert "slap_ros[mujoco]" in " ".join(done.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_task_without_a_plan_is_not_solved_and_counts():
    grasp = {"closed": True, "shift_m": 0.002, "turn_rad": 0.0, "askew_rad": 0.1}
    trials = (
        OpenLoopTrial(300, 0, planned=True, success=True, steps=80, grasps=[grasp]),
        OpenLoopTrial(300, 1, True, False, 90, int(ErrorCode.REPLAY_MISMATCH), "On(a, b)", [grasp]),
        OpenLoopTrial(300, 2, False, False, 0, int(ErrorCode.UNSOLVABLE), "no plan"),
    )
    row = PlayedSkills("training", "seed 0", "digest", trials)
    assert (row.planned.successes, row.solved.successes, row.solved.trials) == (2, 1, 3)
    assert row.failures == {"REPLAY_MISMATCH": 1, "UNSOLVABLE": 1}
    assert row.as_row()[4:] == ["6°", "2.0 mm, 0° → -", "`REPLAY_MISMATCH` 1, `UNSOLVABLE` 1"]


@pytest.mark.timeout(180)  # plans a task twice, and plays both plans
def test_what_the_library_that_ships_stacks_is_stacked_in_mujoco(tmp_path):
    (library, *_) = shipped_skills("stack_at_target")
    done = study("stack_at_target", tmp_path, "--library", str(library))
    assert done.exit_code == 0, done.stderr
    data = json.loads((tmp_path / "open_loop_stack_at_target.json").read_text())
    shipped, shown = data["found"]["rows"]
    assert [shipped["solved"], shown["solved"]] == [1, 1]
    assert shown["skills"] == "demonstrator"
    for row in (shipped, shown):
        (trial,) = row["trials"]
        assert trial["planned"]
        assert 0.0 < max(trial["off_m"].values()) < 0.01  # where MuJoCo has them, not as planned
    page = (tmp_path / "open_loop_stack_at_target.md").read_text()
    assert "| training | demonstrator | 1 of 1 |" in page


@pytest.mark.slow  # more of what the test above shows: with a drawer and a lid
@pytest.mark.timeout(180)
def test_plans_with_a_drawer_and_a_lid_are_played():
    trial = play_task(with_demonstrator("make_coffee", None), "training", 300, 0)
    assert trial.planned
    assert "IsCabinetClose" not in trial.reason  # opened and closed in MuJoCo
    assert 0.0 < trial.off_m["pod"] < 0.02
    assert [grasp["closed"] for grasp in trial.grasps] == [True, False]
