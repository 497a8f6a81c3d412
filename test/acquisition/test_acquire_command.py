# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire`` and ``slap skills``, with a budget that is too small to learn anything."""

import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.usefixtures("points_installed")
SMALL = ["rollouts=2", "validation=2", "skill_steps=200", "segment_episodes=2", "sac.hidden=8,8"]


def slap(*arguments):
    command = [sys.executable, "-m", "ensemble.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=240)


def test_a_library_is_acquired_shown_and_begun_with(tmp_path):
    changes = [word for change in SMALL for word in ("--set", change)]
    made = slap(
        "acquire", "points", "--output", tmp_path / "one", "--steps", 200, "--json", *changes,
        "--set", "sac.random_steps=96", "--jobs", 1,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    record = json.loads(made.stdout)
    assert (record["ended"], record["goal"]) == ("the budget is spent", "train")
    assert record["command"].startswith("slap acquire points --preset two")
    shown = slap("skills", tmp_path / "one", "--json")
    (skill,) = json.loads(shown.stdout)["skills"]
    assert (skill["operator"]["name"], skill["seed"]) == ("Pick", 0)
    assert "Holding(?thing)" in slap("skills", tmp_path / "one").stderr
    again = slap(
        "acquire", "points", "--output", tmp_path / "two", "--from", tmp_path / "one", "--steps",
        200, "--json", *changes, "--set", "sac.random_steps=96", "--jobs", 1,
    )  # fmt: skip
    assert json.loads(again.stdout)["began_with"] == ["one"]
    (second,) = json.loads(slap("skills", tmp_path / "two", "--json").stdout)["skills"]
    assert second["began_with"]["similarity"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["obstacle2d"], "does not say what skills are acquired with"),
        (["points", "--goal", "nope"], "no goal 'nope'"),
        (["points", "--settings", "huge"], "unknown settings 'huge'"),
        (["points", "--set", "sac.gamma=1"], "unknown setting 'sac.gamma'"),
        (["points", "--proposer", "oracle"], "--proposer 'oracle'"),
        (["points", "--from", "nowhere"], "nowhere: no such folder"),
    ],
)
def test_bad_input_is_refused(tmp_path, arguments, reason):
    answer = slap("acquire", *arguments, "--output", tmp_path / "library")
    assert answer.returncode not in (0, 1)
    assert reason in " ".join(answer.stderr.split())
    assert not (tmp_path / "library").exists()
