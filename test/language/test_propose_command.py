# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap propose``: the example, files of anyone, a server, and a line for each refusal."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode
from support.model_answers import good_script, operator_json
from support.paper_problems import peg_in_hole, printed_insert
from support.scripted_server import Step, serving
from support.slap_command import slap

EXAMPLE = Path(__file__).parent.parent.parent / "examples" / "peg_in_hole"
PEGS = peg_in_hole()
TASK = (EXAMPLE / "domain.pddl", EXAMPLE / "problem.pddl")
REPLAY = f"replay:{EXAMPLE / 'scripted.jsonl'}"


def test_the_example_replays_to_a_plan_that_slap_plan_finds_too(tmp_path: Path) -> None:
    """If a prompt was changed on purpose: ``cd test && python -m support.record_example``."""
    command = ("propose", *TASK, "--proposer", "language", "--cassette", REPLAY, "--json")
    result = slap(*command, "--output", tmp_path)
    assert result.exit_code == 0, result.stderr
    answer = json.loads(result.stdout)
    assert len(answer["proposal"]["plan"]) == 4
    assert "goals_never_together" in [kind for e in answer["attempts"] for kind in e["errors"]]
    assert json.loads((tmp_path / "proposal.json").read_text()) == answer["proposal"]
    lines = (tmp_path / "attempts.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == answer["attempts"]
    planned = slap("plan", tmp_path / "domain.pddl", tmp_path / "problem.pddl", "--json")
    assert len(json.loads(planned.stdout)["plan"]) == 4


def test_the_papers_printed_operators_are_refused_with_the_reason() -> None:
    result = slap("propose", *TASK, "--operators", EXAMPLE / "printed.txt")
    assert result.exit_code == ErrorCode.PROPOSAL_REJECTED
    assert "HandEmpty is deleted by Pick and never added again" in result.stderr


def test_operators_of_anyone_in_each_format(tmp_path: Path) -> None:
    made = slap("propose", *TASK, "--proposer", "language", "--cassette", REPLAY,
                "--output", tmp_path)  # fmt: skip
    assert made.exit_code == 0
    text = (EXAMPLE / "printed.txt").read_text()
    repaired = text.replace("{In(?peg, ?hole)}", "{In(?peg, ?hole), HandEmpty()}")
    (tmp_path / "repaired.txt").write_text(repaired)
    (tmp_path / "shown.txt").write_text(made.stdout)
    for name in ("domain.pddl", "proposal.json", "repaired.txt", "shown.txt"):
        result = slap("propose", *TASK, "--operators", tmp_path / name, "--json")
        assert result.exit_code == 0, result.stderr
        proposal = json.loads(result.stdout)["proposal"]
        assert len(proposal["plan"]) == 4 and proposal["provenance"]["source"] == name


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("", "MALFORMED_ANSWER", "has no operators"),
        ('{"operators": 3}', "MALFORMED_ANSWER", "no proposal's JSON"),
        ("(define (domain x)", "MALFORMED_PDDL", ""),
        ("Pick\nPAR: {?peg}", "MALFORMED_ANSWER", "no part PRE"),
        ('{"operators": [1]}', "MALFORMED_ANSWER", "no proposal's JSON"),
        ('{"operators": [{"name": "Pick"}]}', "MALFORMED_ANSWER", "operators, operator 1: the"),
        ("Pick\nPAR: {?peg}\nPRE: {}\nEFF-: {}\nEFF+: {Gripped(?peg)}", "PROPOSAL_REJECTED",
         "there is no predicate 'Gripped'"),
    ],
)  # fmt: skip
def test_files_that_will_not_do(tmp_path: Path, text: str, code: str, words: str) -> None:
    file = tmp_path / "operators"
    file.write_text(text)
    result = slap("propose", *TASK, "--operators", file)
    assert result.exit_code == ErrorCode[code]
    assert words in " ".join(result.stderr.split())


def test_a_server_is_asked_and_what_it_costs_is_shown(tmp_path: Path) -> None:
    printed = operator_json(printed_insert())
    cassette = tmp_path / "new.jsonl"
    steps = [Step(printed), Step(operator_json(PEGS.operators[1]))]
    with serving(good_script(PEGS, Insert=steps)) as server:
        command = ("propose", *TASK, "--proposer", "language", "--model", "m")
        result = slap(*command, "--base-url", server.url, "--cassette", f"record:{cassette}")
    assert result.exit_code == 0, result.stderr
    assert "4 attempts, 440 tokens" in result.stdout
    assert "goals_never_together" in result.stderr
    assert "answers are a script's" in result.stderr
    again = slap(*command, "--cassette", f"replay:{cassette}")
    assert again.exit_code == 0 and "4 attempts, 440 tokens" in again.stdout
    assert "replayed from recording" in " ".join(again.stderr.split())


def test_a_domain_with_a_world_proposes_its_own_operators() -> None:
    result = slap("propose", "obstacle2d", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["proposal"]["provenance"]["proposer"] == "manual"


def test_a_bag_is_a_demonstration() -> None:
    """The recorded run used a shortcut, and that is what it shows."""
    bag = EXAMPLE.parent.parent / "test" / "bags" / "data" / "recorded_by_0.1.0"
    result = slap("propose", "obstacle2d", "--proposer", "induced", "--demonstrations", bag)
    assert result.exit_code == 0, result.stderr
    assert "proposer induced (demonstrations: 1, from recorded_by_0.1.0)" in result.stdout
    assert "seen once; each of its preconditions may be too many" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ((*TASK, "--proposer", "oracle"), "INVALID_PARAMETER"),
        ((*TASK, "--rewarder", "money"), "INVALID_PARAMETER"),
        ((*TASK, "--proposer", "induced"), "INVALID_PARAMETER"),
        ((*TASK,), "INVALID_DOMAIN"),
        ((*TASK, "--proposer", "language"), "LANGUAGE_UNAVAILABLE"),
        ((*TASK, "--proposer", "language", "--model", "m"), "LANGUAGE_UNAVAILABLE"),
        ((*TASK, "--proposer", "language", "--cassette", "off"), "LANGUAGE_OFF"),
        ((*TASK, "--proposer", "language", "--cassette", "tape"), "INVALID_PARAMETER"),
        ((*TASK, "--proposer", "language", "--cassette", "replay:/nowhere"), "INVALID_CASSETTE"),
        ((*TASK, "--proposer", "language", "--model", "o", "--cassette", REPLAY), "CASSETTE_MISS"),
        ((*TASK, "--proposer", "language", "--seconds", "0"), "INVALID_PARAMETER"),
        (("obstacle2d", "--proposer", "induced", "--demonstrations", "/nowhere"), "DAMAGED_BAG"),
        (("obstacle2d", "--rewarder", "composed"), "INVALID_DOMAIN"),
        (("obstacle2d", "--model", "m"), "INVALID_PARAMETER"),
        (("obstacle2d", "--cassette", REPLAY), "INVALID_PARAMETER"),
        (("nowhere",), "UNKNOWN_DOMAIN"),
    ],
)
def test_each_refusal_has_its_code(arguments: tuple[object, ...], code: str) -> None:
    result = slap("propose", *arguments)
    assert result.exit_code == ErrorCode[code], result.stderr
    assert "Traceback" not in result.stderr and result.stderr.startswith("error ")
