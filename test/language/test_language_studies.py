# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies of language models count what was answered, and take no script for a model."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode, InvalidCassetteError
from slap_ros.language.cassette import open_client, read_cassette
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.imitation import ImitationOptions
from slap_ros.studies.lg_sail.model_attempts import LanguageModel, ModelsOnly
from slap_ros.studies.lg_sail.model_options import ModelOptions
from slap_ros.studies.lg_sail.models import SeveralModelsOptions
from slap_ros.studies.lg_sail.planning_ablation import (
    ALONE,
    ONE_SHOT,
    PAPER,
    SEARCH,
    VariantOptions,
)
from slap_ros.studies.lg_sail.planning_ablation import study as planning_ablation
from slap_ros.studies.lg_sail.reward_ablation import FULL, HEADERS, RewardOptions
from slap_ros.studies.lg_sail.reward_ablation import study as reward_ablation
from slap_ros.studies.registry import STUDIES
from slap_ros.studies.results import MarkdownTable, Provenance, StudyReport, write
from slap_ros.studies.study_log import StudyLog
from support.model_answers import SETTINGS, decomposition_json, operator_json, plan_json
from support.paper_problems import peg_in_hole
from support.scripted_server import Step, serving
from support.slap_command import slap

ROOT = Path(__file__).parents[2]
PEGS = peg_in_hole()
PICK, INSERT = PEGS.operators
GOOD = {
    "decomposition": [Step(decomposition_json(PEGS.operators))],
    "operator Pick": [Step(operator_json(PICK))],
    "operator Insert": [Step(operator_json(INSERT))],
}
COMMAND = ["study", "planning_ablation", "obstacle2d", "--model", "m"]
STEPS = ["Pick(peg1)", "Insert(peg1, hole1)", "Pick(peg2)", "Insert(peg2, hole2)"]


class Silent:
    """Shows no progress."""

    def begin(self, what: str, total: int) -> None: ...

    def advance(self) -> None: ...

    def report_failure(self, complaint: str) -> None: ...


def runner(folder: Path) -> JobRunner:
    return JobRunner(StudyLog(folder / "log", Provenance("pegs", "", {})), 1, Silent())


def ask(
    folder: Path, script: Mapping[str, Sequence[Step]], variants: Sequence[str], plans: int = 2
) -> dict:
    with serving(script) as server:
        settings = type(SETTINGS)(model="scripted", base_url=server.url, retry=SETTINGS.retry)
        model = LanguageModel(open_client("live", settings), settings)
        report = planning_ablation(
            {"m": model}, [PEGS.problem] * plans, variants, 3, runner(folder)
        )
        seeds = [request["seed"] for request in server.requests]
    assert len(set(seeds)) > 1 or plans == 1
    return {tally["variant"]: tally for tally in report.found["tallies"]}


def test_a_good_model_needs_one_attempt_and_the_planner_does_the_rest(tmp_path: Path) -> None:
    script = GOOD | {"plan": [Step(plan_json(STEPS))]}
    found = ask(tmp_path, script, (SEARCH, ALONE, ONE_SHOT))
    for variant in (SEARCH, ALONE, ONE_SHOT):
        assert found[variant]["operators"] == (2, 2)
        assert found[variant]["planning"] == (2, 2)
        assert found[variant]["overall"] == (2, 2)
        assert found[variant]["attempts"] == 1.0


def test_an_attempt_ends_with_the_first_answer_that_does_not_pass(tmp_path: Path) -> None:
    wrong = json.loads(operator_json(PICK))
    wrong["preconditions"][0]["predicate"] = "Shiny"
    with serving(GOOD | {"operator Pick": [Step(json.dumps(wrong))]}) as server:
        settings = type(SETTINGS)(model="scripted", base_url=server.url, retry=SETTINGS.retry)
        model = LanguageModel(open_client("live", settings), settings)
        report = planning_ablation({"m": model}, [PEGS.problem], (SEARCH,), 3, runner(tmp_path))
    assert len(server.requests) == 3 * len(("decomposition", "Pick"))
    (trial,) = report.found["tallies"][0]["trials"]
    assert trial["attempts"] == ["operator: unknown_predicate"] * 3
    assert "**Plans: 1; wanted: 25.**" in report.measured


def test_what_was_asked_already_is_not_asked_again(tmp_path: Path) -> None:
    found = ask(tmp_path, GOOD, (SEARCH,))
    with serving(GOOD) as server:
        settings = type(SETTINGS)(model="scripted", base_url=server.url, retry=SETTINGS.retry)
        model = LanguageModel(open_client("live", settings), settings)
        again = planning_ablation({"m": model}, [PEGS.problem] * 3, [SEARCH], 3, runner(tmp_path))
        seeds = {request["seed"] for request in server.requests}
    assert seeds == {6}  # of the third plan; the others are known
    (tally,) = again.found["tallies"]
    assert tally["trials"][:2] == found[SEARCH]["trials"]
    assert tally["overall"] == (3, 3)


def test_what_is_wrong_is_counted_by_class_and_tried_again(tmp_path: Path) -> None:
    wrong = json.loads(operator_json(PICK))
    wrong["preconditions"][0]["predicate"] = "Shiny"
    script = GOOD | {
        "operator Pick": [Step(json.dumps(wrong)), *GOOD["operator Pick"]],
        "plan": [Step(plan_json(STEPS))],
    }
    found = ask(tmp_path, script, (SEARCH,))[SEARCH]
    assert found["operators"] == (2, 3)
    assert found["overall"] == (2, 2)
    assert found["attempts"] == 1.5
    assert found["errors"] == {"unknown_predicate": 1}
    found = ask(tmp_path, script, (ONE_SHOT,))[ONE_SHOT]
    assert found["overall"] == (1, 2)
    assert found["operators"] == (1, 2)


def test_a_plan_of_the_model_is_carried_out(tmp_path: Path) -> None:
    short = Step(plan_json(STEPS[:2]))
    impossible = Step(plan_json(STEPS[1:]))
    script = GOOD | {"plan": [short, impossible, Step(plan_json(STEPS))]}
    found = ask(tmp_path, script, (ALONE,), plans=1)[ALONE]
    assert found["operators"] == (3, 3)
    assert found["planning"] == (1, 3)
    assert found["attempts"] == 3.0
    assert found["errors"] == {"goal_not_reached": 1, "impossible_step": 1}


def test_the_printed_operators_never_chain(tmp_path: Path) -> None:
    printed = json.loads(operator_json(INSERT))
    printed["add_effects"] = [a for a in printed["add_effects"] if a["predicate"] != "HandEmpty"]
    found = ask(tmp_path, GOOD | {"operator Insert": [Step(json.dumps(printed))]}, (SEARCH,))[
        SEARCH
    ]
    assert found["operators"] == (0, 6)
    assert found["overall"] == (0, 2)
    assert found["attempts"] is None
    assert found["errors"] == {"goals_never_together": 6}


def test_rewards_are_judged_by_the_papers_classes(tmp_path: Path) -> None:
    good = Step('{"parallel_dis(?peg, ?hole)": 0.4}')
    to_peg = Step('{"dis_to_obj(?peg)": 0.4}')
    invented = Step('{"depth(?peg)": 0.4}')
    script = {"reward of Pick": [to_peg], "reward of Insert": [good, invented, good, good]}
    with serving(script) as server:
        settings = type(SETTINGS)(model="scripted", base_url=server.url, retry=SETTINGS.retry)
        model = LanguageModel(open_client("live", settings), settings)
        report = reward_ablation(
            model, PEGS.problem, PEGS.operators, (FULL, HEADERS), 2, runner(tmp_path)
        )
        asked = [request["messages"][-1]["content"] for request in server.requests]
    full, headers = report.found["trials"]
    assert (full["all_right"], headers["all_right"]) == (1, 2)
    assert full["right"] == {"Pick": 2, "Insert": 1}
    assert full["errors"] == {"hallucination": 1}
    assert "return" in asked[0]  # the metrics' source
    assert "return" not in asked[-1]


def test_the_papers_arithmetic() -> None:
    """Of its own table: attempts are what the two shares make them, and so is one shot."""
    operators, planning, _, attempts = PAPER[SEARCH]
    assert 1.0 / (operators * planning) == pytest.approx(attempts, abs=0.005)
    operators, planning, _, attempts = PAPER[ALONE]
    assert 1.0 / (operators * planning) == pytest.approx(attempts, abs=0.005)
    operators, planning, overall, _ = PAPER[ONE_SHOT]
    assert operators * planning == pytest.approx(overall, abs=0.005)


def test_what_a_script_says_is_no_result(tmp_path) -> None:
    with serving(GOOD) as server:
        settings = type(SETTINGS)(model="scripted", base_url=server.url, retry=SETTINGS.retry)
        client = ModelsOnly(open_client("live", settings))
        with pytest.raises(InvalidCassetteError, match="no result of a study"):
            planning_ablation(
                {"m": LanguageModel(client, settings)},
                [PEGS.problem],
                (SEARCH,),
                1,
                runner(tmp_path),
            )
        live = slap(*COMMAND, "--base-url", server.url, "--output", tmp_path)
    assert live.exit_code == ErrorCode.INVALID_CASSETTE
    assert "no result of a study" in " ".join(live.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_page_names_the_day_and_the_recording(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    cassette = ROOT / "examples" / "peg_in_hole" / "scripted.jsonl"
    report = StudyReport(
        "models", "", "title", "", MarkdownTable(("a",), ()), {}, lambda figure: None, (2.0, 2.0)
    )
    dated = ModelOptions(domain="pegs", cassette=f"replay:{cassette}").dated(report)
    digest = sha256(cassette.read_bytes()).hexdigest()
    assert dated.circumstances["recording_sha256"] == digest
    assert dated.circumstances["answered_on"] == read_cassette(cassette).recorded[:10]
    write(tmp_path, dated, Provenance("pegs", "", {}), 1.0)
    assert digest in (tmp_path / "models_pegs.md").read_text()
    assert json.loads((tmp_path / "models_pegs.json").read_text())["recording_sha256"] == digest
    assert set(ModelOptions(domain="pegs").dated(report).circumstances) == {"answered_on"}


@pytest.mark.parametrize(
    ("study", "options"),
    [
        ("planning_ablation", VariantOptions),
        ("models", SeveralModelsOptions),
        ("reward_ablation", RewardOptions),
        ("imitation", ImitationOptions),
    ],
)
def test_the_command_on_a_page_repeats_what_was_recorded(tmp_path, study, options) -> None:
    if study == "imitation":
        pytest.importorskip("torch")
    commands = []
    for cassette in ("live", f"record:{tmp_path / 'my answers.jsonl'}"):
        asked = options(
            domain="stack_at_target", model=["m"], base_url="http://127.0.0.1:9", cassette=cassette
        )
        ready = STUDIES[study].prepare(asked, lambda _: None)
        origin = Provenance.of_command(study, asked.domain, ready.settings, ready.given)
        commands.append(shlex.split(origin.command))
    live, recorded = commands
    assert "--cassette" not in live
    at = recorded.index("--cassette")
    assert recorded[at + 1] == f"replay:{tmp_path / 'my answers.jsonl'}"
    assert recorded[:at] + recorded[at + 2 :] == live


def test_the_command_refuses_what_cannot_be() -> None:
    def refusal(*arguments: str) -> str:
        result = slap("study", *arguments)
        assert result.exit_code == ErrorCode.INVALID_PARAMETER, result.stderr
        return " ".join(result.stderr.split())

    obstacle = ("obstacle2d", "--model", "m", "--base-url", "http://127.0.0.1:9/v1")
    assert "there are language+search, language, one_shot" in refusal(
        "planning_ablation", *obstacle, "--variants", "tarot"
    )
    assert "names a model twice" in refusal("models", *obstacle, "--model", "m")
    assert "there are full, headers" in refusal("reward_ablation", *obstacle, "--metrics", "half")
    assert "has no metrics" in refusal("reward_ablation", *obstacle)
