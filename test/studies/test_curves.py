# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning curves are those of the records, and a record without one is said to have none."""

import json
from pathlib import Path

import numpy as np
import pytest

from slap_ros.baselines.trained_baseline import TrainedBaseline, save_baseline
from slap_ros.baselines.training_envs import as_observed
from slap_ros.errors import ErrorCode
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.studies.registry import STUDIES
from support.slap_command import slap

pytest.importorskip("matplotlib")
ROOT = Path(__file__).parent.parent
SHIPPED = ROOT.parent / "models" / "shortcuts" / "cleanup_table"
WITHOUT_CURVE = ROOT.parent / "models" / "learners" / "cleanup_table" / "sac"
RECORD = {"environment_steps": 3000, "command": "slap baseline train ppo cleanup_table"}
CURVE = [[1000, 0.0], [2000, 0.5], [3000, 0.75]]


def baseline(folder, goal=None, **record):
    """A policy of one feature, which nothing runs here."""
    layers = ((np.zeros((7, 1), np.float32), np.zeros(7, np.float32)),)
    policy = MlpPolicy(as_observed(1), layers, np.zeros(7, np.float32))
    environment = {"obs": "state", "control": "joints", "reward": "sparse"}
    about = (environment, policy, 0.0, RECORD | record)
    save_baseline(folder, TrainedBaseline("ppo", "cleanup_table", "paper", goal, *about))
    return folder


def study(output, *arguments):
    return slap("study", "curves", "cleanup_table", "--output", output, *arguments)


def test_every_training_has_its_curve_or_is_said_to_have_none(tmp_path):
    learned = baseline(tmp_path / "learned", success_curve=CURVE)
    older, other = baseline(tmp_path / "older"), baseline(tmp_path / "other", goal="elsewhere")
    libraries = ("--library", SHIPPED, "--library", WITHOUT_CURVE)
    baselines = [part for one in (learned, older, other) for part in ("--against", one)]
    ran = study(tmp_path / "out", *libraries, *baselines)
    assert ran.exit_code == 0, ran.output
    assert "trained for another goal, elsewhere" in " ".join(ran.stderr.split())
    found = json.loads((tmp_path / "out" / "curves_cleanup_table.json").read_text())["found"]
    shortcut, without, ppo, old = found["rows"]
    (path,) = SHIPPED.glob("*/shortcut.json")
    record = json.loads(path.read_text())["record"]
    assert shortcut["curve"] == record["success_curve"]
    assert shortcut["curve"][-1][0] == shortcut["steps"] == record["environment_steps"]
    assert (ppo["curve"], ppo["half"], ppo["learns"]) == (CURVE, 2000, "whole task")
    assert ppo["trained"][0]["command"] == RECORD["command"]
    assert without["curve"] == old["curve"] == []
    page = (tmp_path / "out" / "curves_cleanup_table.md").read_text()
    assert "| PPO | whole task | `paper` | `learned` |  | 3,000 | 75% | 2,000 |" in page
    assert "| PPO | whole task | `paper` | `older` |  | 3,000 | - | no curve recorded |" in page
    assert "| 200,000 | 94% | no curve recorded |" in page  # its end is known
    picture = (tmp_path / "out" / "curves_cleanup_table.svg").read_text()
    assert "SAC, a policy each: no curve recorded" in picture
    said = STUDIES["curves"].summary(found)
    assert "`fair`: SAC, a policy each 94% after 200,000 steps" in said
    assert "`paper`: PPO 75% after 3,000 steps" in said


def test_without_any_training_there_is_nothing_to_show(tmp_path):
    ran = slap("study", "curves", "bowls", "--output", tmp_path)
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER
    assert "`slap train bowls` made" in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
