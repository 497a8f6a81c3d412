# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learners of the whole task beside acquired skills: the rows are those of tasks and records."""

import json
from pathlib import Path

import numpy as np
import pytest

from slap_ros.baselines.trained_baseline import TrainedBaseline, save_baseline
from slap_ros.baselines.training_envs import as_observed
from slap_ros.environments.registration import make_task_env
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.studies.lg_sail.progress import MeasuredTraining
from slap_ros.studies.registry import STUDIES
from support.slap_command import slap

pytest.importorskip("matplotlib")
STAGES = {"obs": "dict", "control": "joints", "reward": "stages"}
RECORD = {"seed": 0, "environment_steps": 4000, "cpu_s": 60.0, "command": "slap baseline train …"}
CURVE = [[0, 0.0], [4000, 0.25]]


@pytest.fixture(scope="module")
def features():
    return make_task_env("stack_at_target", "fair", obs="dict", reward="stages").observed_features


def baseline(folder, features, method="sac", preset="fair", **record):
    """A policy that holds still."""
    layers = ((np.zeros((5, features), np.float32), np.zeros(5, np.float32)),)
    quiet = np.full(5, -20.0, np.float32)
    policy = MlpPolicy(as_observed(features), layers, quiet, "relu", squashed=True)
    about = RECORD | {"task_progress": CURVE} | record
    trained = TrainedBaseline(
        method, "stack_at_target", preset, "training", STAGES, policy, 0.0, about
    )
    save_baseline(folder, trained)
    return folder


def study(*arguments):
    command = ["study", "progress", "stack_at_target", "--tasks", 2, "--goal", "training"]
    return slap(*command, *arguments)


def test_who_holds_still_does_nothing_and_skills_do_all_stages(tmp_path, features):
    one, two = (baseline(tmp_path / f"stack-sac-{i}", features) for i in range(2))
    ran = study(
        "--library", "models/skills/stack_at_target",
        "--against", one, "--against", two, "--output", tmp_path / "out",
    )  # fmt: skip
    assert ran.exit_code == 0, ran.output
    found = json.loads((tmp_path / "out" / "progress_stack_at_target.json").read_text())["found"]
    ours, sac = found["rows"]
    assert (ours["method"], sac["method"]) == ("ours (manual, manual)", "sac")
    assert sac["task_progress"]["mean"] == 0.0
    assert ours["task_progress"]["mean"] > 0.7
    assert [training["name"] for training in sac["trainings"]] == ["stack-sac-0", "stack-sac-1"]
    assert sac["trainings"][0]["curve"] == CURVE
    assert [len(training["tasks"]) for training in sac["trainings"]] == [2, 2]
    assert [one["name"] for one in sac["trained"]] == ["stack-sac-0", "stack-sac-1"]
    assert "sac 0.00 after 4,000 steps" in STUDIES["progress"].summary(found)
    page = (tmp_path / "out" / "progress_stack_at_target.md").read_text()
    assert "| training | sac | 2 × 2 | 4000 ± 0 | 0.00 ± 0.00 | 0%" in page
    assert "| training | ours (manual, manual) | 1 × 2 | 18000 | " in page  # one has no spread


def test_where_there_is_no_other_those_that_ship_are_compared(tmp_path, monkeypatch):
    shipped = Path("models/skills/stow_hammer").resolve()
    monkeypatch.chdir(tmp_path)
    ran = slap(
        "study", "progress", "stow_hammer", "--library", shipped, "--tasks", 1,
        "--goal", "training", "--output", tmp_path,
    )  # fmt: skip
    assert ran.exit_code == 0, ran.output
    made = json.loads((tmp_path / "progress_stow_hammer.json").read_text())
    assert {"sac", "curriculum", "maple"} < {row["method"] for row in made["found"]["rows"]}
    assert "--against" not in made["command"]


def test_what_cannot_be_compared_is_left_out_with_a_reason(tmp_path, features):
    other = baseline(tmp_path / "other", features, preset="paper")
    unmeasured = baseline(tmp_path / "unmeasured", features)
    about = json.loads((unmeasured / "baseline.json").read_text())
    del about["record"]["task_progress"]
    (unmeasured / "baseline.json").write_text(json.dumps(about))
    ran = study("--against", other, "--against", unmeasured, "--output", tmp_path / "out")
    assert ran.exit_code != 0
    said = " ".join(ran.stderr.split())
    assert "trained under paper, not fair" in said
    assert "task progress was not measured" in said
    assert "slap baseline train sac stack_at_target" in said


def test_of_an_older_record_only_the_ends_are_known():
    record = {"steps": 18000, "progress": [0.0, 0.25, 0.98, 0.99]}
    old = MeasuredTraining.of_library("a", record)
    assert (old.curve, old.is_whole) == (((0, 0.0), (18000, 0.99)), False)
    new = MeasuredTraining.of_library("a", record | {"progress_steps": [0, 6000, 14000, 18000]})
    assert new.curve == ((0, 0.0), (6000, 0.25), (14000, 0.98), (18000, 0.99))
    assert new.is_whole
