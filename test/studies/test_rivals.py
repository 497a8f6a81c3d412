# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rows of other learners are those of their trials."""

import json
import shutil
from dataclasses import replace

import pytest

from slap_ros.api.baselines import train_baseline
from slap_ros.baselines.trained_baseline import load_baseline, save_baseline
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from support.slap_command import slap
from support.study_helpers import in_this_process

SHORT = {"n_envs": 2, "n_steps": 16, "batch_size": 16, "validation": 1}


def rivals(domain, *arguments):
    result = slap("study", "rivals", domain, *arguments)
    return result.exit_code, " ".join(result.stderr.split())


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Hierarchical learning, and PPO twice, as if it had been trained with two seeds."""
    folder = tmp_path_factory.mktemp("baselines")
    domain = get_domain("obstacle2d", "paper")
    for method in ("ppo", "hierarchical"):
        path = folder / f"obstacle2d-{method}-0"
        train_baseline(method, domain, path, steps=64, changes=SHORT)
    shutil.copytree(folder / "obstacle2d-ppo-0", folder / "obstacle2d-ppo-1")
    return sorted(folder.glob("obstacle2d-*[0-9]"))


def test_a_method_has_a_row_with_all_its_trainings(tmp_path, monkeypatch, trained):
    in_this_process(monkeypatch)
    against = [part for folder in trained for part in ("--against", folder)]
    code, said = rivals("obstacle2d", "--tasks", 4, "--seeds", 1, "--output", tmp_path, *against)
    assert code == 0, said
    data = json.loads((tmp_path / "rivals_obstacle2d.json").read_text())
    rows = {row["approach"]: row for row in data["found"]["rows"]}
    assert list(rows) == ["pure_planning", "hierarchical", "ppo"]
    assert rows["pure_planning"]["success_rate"] == 1.0
    names = [one["name"] for one in rows["ppo"]["trained"]]
    assert names == ["obstacle2d-ppo-0", "obstacle2d-ppo-1"]
    for row in rows.values():
        trials = [trial for one in row["libraries"] for trial in one["trials"]]
        assert row["success_rate"] == sum(t["success"] for t in trials) / len(trials)
    assert len(data["baselines"]) == 3
    page = (tmp_path / "rivals_obstacle2d.md").read_text()
    assert "| `paper` | 3 × 2 | PPO | 0% " in page


def test_a_policy_that_acts_with_noise_tries_equal_tasks_as_well(tmp_path, monkeypatch, trained):
    in_this_process(monkeypatch)
    noisy = replace(load_baseline(trained[1], get_domain("obstacle2d", "paper")), noise=1.0)
    save_baseline(tmp_path / "obstacle2d-noisy", noisy)
    given = ["--tasks", 4, "--seeds", 1, "--against", tmp_path / "obstacle2d-noisy"]
    code, said = rivals("obstacle2d", "--output", tmp_path, *given)
    assert code == 0, said
    page = (tmp_path / "rivals_obstacle2d.md").read_text()
    assert "| `paper` | 3 | pure planning | 100% " in page
    assert "| `paper` | 4 × 1 | PPO | 0% " in page


def test_without_a_baseline_there_is_nothing_to_compare(tmp_path, trained):
    code, said = rivals("stow_hammer", "--output", tmp_path, "--against", trained[0])
    assert code == ErrorCode.INVALID_PARAMETER
    assert "a baseline is left out" in said
    assert "slap baseline train METHOD stow_hammer" in said
    assert not list(tmp_path.iterdir())
