# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire`` and ``slap skills``, with a budget that is too small to learn anything."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.cli.acquire import why_left
from slap_ros.errors import ErrorCode
from support.model_answers import good_script
from support.points import PICK, POINTS, PUT
from support.scripted_server import serving
from support.slap_command import slap

pytestmark = pytest.mark.usefixtures("points_installed")
SMALL = [
    "rollouts=2", "validation=2", "skill_steps=200", "segment_episodes=2", "sac.net_arch=8,8",
    "sac.learning_starts=96", "warm_start.critic_updates=10",
]  # fmt: skip
SHORTCUTS = str(Path(__file__).parents[2] / "models" / "shortcuts" / "obstacle2d")
BUDGET = [*(word for change in SMALL for word in ("--set", change)), "--steps", 200, "--jobs", 1]


@pytest.mark.slow
@pytest.mark.training
def test_a_library_is_acquired_shown_and_begun_with(tmp_path, in_this_process):
    made = slap("acquire", "points", "--output", tmp_path / "one", "--json", *BUDGET)
    assert made.exit_code == 0, made.stderr
    record = json.loads(made.stdout)
    assert (record["ended"], record["goal"]) == ("the budget is spent", "train")
    assert record["command"].startswith("slap acquire points --preset two")
    shown = slap("skills", tmp_path / "one", "--json")
    (skill,) = json.loads(shown.stdout)["skills"]
    assert (skill["operator"]["name"], skill["seed"]) == ("Pick", 0)
    assert "Holding(?thing)" in slap("skills", tmp_path / "one").stdout
    begin = ("--from", tmp_path / "one", "--set", "warm_start.least_success=0")  # it knows little
    again = slap("acquire", "points", "--output", tmp_path / "two", *begin, "--json", *BUDGET)
    record = json.loads(again.stdout)
    assert record["began_with"] == ["one"]
    assert " --from one " in record["command"]  # without the path of this machine
    (second,) = json.loads(slap("skills", tmp_path / "two", "--json").stdout)["skills"]
    assert second["began_with"]["similarity"] == 1.0
    assert "(similarity 1.00, success" in slap("skills", tmp_path / "two").stdout


@pytest.mark.training
def test_operators_and_rewards_come_from_whoever_is_named(tmp_path, in_this_process):
    """From demonstrations and metrics; and the same training is not mistaken for another."""
    asked = ("acquire", "points", "--output", tmp_path / "library", "--json", *BUDGET)
    by = ("--proposer", "induced", "--demonstrations", 2, "--rewarder", "composed")
    made = slap(*asked, *by)
    assert made.exit_code == 0, made.stderr
    record = json.loads(made.stdout)
    assert (record["proposer"], record["rewarder"]) == ("induced", "composed")
    assert record["provenance"]["source"] == "demonstrations: 2, from the domain's demonstrator"
    assert "--proposer induced --demonstrations 2 --rewarder composed" in record["command"]
    assert "answered_by" not in record
    assert json.loads(slap(*asked, *by).stdout) == record
    other = slap(*asked)
    assert "has another training, of `slap acquire points" in " ".join(other.stderr.split())
    shown = slap("skills", tmp_path / "library").stdout
    assert "AchieveHolding(?thing: thing)" in shown
    assert "proposer and rewarder: induced and composed" in shown


@pytest.mark.training
def test_what_a_script_said_is_never_taken_for_a_models(tmp_path, in_this_process):
    """Recorded, and replayed: both libraries say that no model answered, or not now."""
    problem = AcquisitionProblem.of_task(POINTS, POINTS.task(0))
    printed = SimpleNamespace(problem=problem, operators=(PICK, PUT))
    recording = tmp_path / "script.jsonl"
    by = ("acquire", "points", "--proposer", "language", "--rewarder", "language", "--json")
    with serving(good_script(printed)) as server:
        made = slap(
            *by, "--output", tmp_path / "recorded", "--cassette", f"record:{recording}",
            "--base-url", server.url, "--model", "scripted", *BUDGET,
        )  # fmt: skip
    assert made.exit_code == 0, made.stderr
    recorded = json.loads(made.stdout)
    assert recorded["answered_by"]["scripted"]
    assert recorded["answered_by"]["replayed_cassette"] == ""
    again = slap(
        *by, "--output", tmp_path / "replayed", "--cassette", f"replay:{recording}", *BUDGET
    )
    replayed = json.loads(again.stdout)
    assert replayed["answered_by"]["scripted"]
    assert replayed["digest"] == recorded["digest"]
    assert "a script's" in again.stderr
    assert "replayed from recording" in slap("skills", tmp_path / "replayed").stdout


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["obstacle2d"], "does not say what skills are acquired with"),
        (["points", "--goal", "nope"], "no goal 'nope'"),
        (["points", "--steps", "10"], "a skill is judged after 480; give more --steps"),
        (["points", "--settings", "huge"], "unknown settings 'huge'"),
        (["points", "--set", "sac.nonsense=1"], "unknown setting 'sac.nonsense'"),
        (["points", "--proposer", "oracle"], "--proposer 'oracle'"),
        (["points", "--rewarder", "none"], "--rewarder 'none'"),
        (["points", "--demonstrations", "3"], "are for --proposer induced"),
        (["points", "--proposer", "language", "--cassette", "off"], "--cassette is off"),
        (["points", "--from", "nowhere"], "nowhere: no such folder"),
        (["points", "--keep", "nowhere"], "nowhere: no such folder"),
        (["points", "--from", SHORTCUTS], "a library of shortcuts, not of skills; `slap acquire"),
    ],
)
def test_bad_input_is_refused(tmp_path, arguments, reason):
    answer = slap("acquire", *arguments, "--output", tmp_path / "library")
    assert answer.exit_code not in (0, 1)
    assert reason in " ".join(answer.stderr.split())
    assert not (tmp_path / "library").exists()


@pytest.mark.training
def test_a_command_that_was_corrected_finds_no_other_training_in_its_folder(
    tmp_path, in_this_process
):
    """Libraries are read before anything is proposed, which may cost a model's time."""
    asked = ("acquire", "points", "--output", tmp_path / "library", "--json", *BUDGET)
    assert "no such folder" in slap(*asked, "--from", tmp_path / "nowhere").stderr
    assert slap(*asked).exit_code == 0


def test_a_library_of_shortcuts_is_not_shown_as_one_of_skills():
    shown = slap("skills", SHORTCUTS)
    assert shown.exit_code == ErrorCode.INVALID_LIBRARY
    assert "a library of shortcuts, not of skills" in " ".join(shown.stderr.split())


def test_a_skill_that_was_given_up_is_described_in_words():
    found = {"why": "no progress", "states": 3, "ends": {"effect not reached": 2}, "atoms": {}}
    assert why_left(found) == "no progress from 3 states: effect not reached (2 times)"
    found["atoms"] = {"Holding(thing0)": 2}
    assert why_left(found).endswith("; most often not as it should be: Holding(thing0) (2 times)")
    assert why_left({"why": "the approach did not arrive"}) == "the approach did not arrive"
