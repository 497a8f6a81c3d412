# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan`` and ``slap propose`` on PDDL files, and engines of unified-planning beside them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from slap_ros.cli.plan_pddl import find_pddl_plan
from slap_ros.errors import ErrorCode
from slap_ros.relational.pddl import parse_domain, parse_problem
from support.slap_command import slap
from tools.check_plan import World, check, read_steps

ROOT = Path(__file__).parents[2]

# A rover sends what it sampled from where it stands: often from where it sampled it.
SURVEY = """(define (domain survey) (:types rover spot)
  (:predicates (at ?r - rover ?s - spot) (sampled ?r - rover ?s - spot) (base ?s - spot)
    (sees ?s ?o - spot) (sent ?s - spot))
  (:action sample :parameters (?r - rover ?s - spot)
    :precondition (at ?r ?s) :effect (sampled ?r ?s))
  (:action send :parameters (?r - rover ?what ?here ?base - spot)
    :precondition (and (sampled ?r ?what) (at ?r ?here) (base ?base) (sees ?here ?base))
    :effect (sent ?what)))"""
SURVEY_TASK = """(define (problem one) (:domain survey) (:objects r - rover hill camp - spot)
  (:init (at r hill) (base camp) (sees hill camp)) (:goal (sent hill)))"""

# Crates to be driven; the long way round costs less than the toll.
HAULAGE = """(define (domain haulage) (:requirements :typing :action-costs)
  (:types truck crate place)
  (:predicates (parked ?t - truck ?p - place) (waiting ?c - crate ?p - place)
    (aboard ?c - crate ?t - truck) (road ?p ?q - place) (motorway ?p ?q - place))
  (:functions (total-cost) - number)
  (:action pay :parameters (?t - truck ?p ?q - place)
    :precondition (and (parked ?t ?p) (motorway ?p ?q))
    :effect (and (parked ?t ?q) (not (parked ?t ?p)) (increase (total-cost) 9)))
  (:action drive :parameters (?t - truck ?p ?q - place)
    :precondition (and (parked ?t ?p) (road ?p ?q))
    :effect (and (parked ?t ?q) (not (parked ?t ?p)) (increase (total-cost) 2)))
  (:action load :parameters (?c - crate ?t - truck ?p - place)
    :precondition (and (waiting ?c ?p) (parked ?t ?p))
    :effect (and (aboard ?c ?t) (not (waiting ?c ?p)) (increase (total-cost) 1)))
  (:action unload :parameters (?c - crate ?t - truck ?p - place)
    :precondition (and (aboard ?c ?t) (parked ?t ?p))
    :effect (and (waiting ?c ?p) (not (aboard ?c ?t)) (increase (total-cost) 1))))"""
HAULAGE_TASK = """(define (problem two) (:domain haulage)
  (:objects t - truck c d - crate x y z - place)
  (:init (parked t x) (waiting c x) (waiting d x) (motorway x z) (road x y) (road y z)
    (= (total-cost) 0))
  (:goal (and (waiting c z) (waiting d z))) (:metric minimize (total-cost)))"""

PAIRS = {"survey": (SURVEY, SURVEY_TASK), "haulage": (HAULAGE, HAULAGE_TASK)}


def invoke(tmp_path: Path, texts: tuple[str, str], command: str, *options: str) -> Result:
    files = [tmp_path / "domain.pddl", tmp_path / "problem.pddl"]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text, encoding="utf-8")
    return slap(command, *files, *options)


def planned(tmp_path: Path, texts: tuple[str, str], *options: str) -> dict[str, Any]:
    result = invoke(tmp_path, texts, "plan", "--json", *options)
    assert result.exit_code == 0, result.stderr
    found: dict[str, Any] = json.loads(result.stdout)
    return found


@pytest.mark.parametrize("effort", ["0", "-1"])
def test_no_effort_is_refused(tmp_path: Path, effort: str) -> None:
    result = invoke(tmp_path, PAIRS["survey"], "plan", "--effort", effort)
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert f"the effort of planning must be 1 at least, got {effort}" in result.stderr


def test_options_about_a_task_are_refused_beside_files_that_have_it(tmp_path: Path) -> None:
    given = ("--goal", "(q zzz)", "--seed", "3", "--output", str(tmp_path / "problem.pddl"))
    result = invoke(tmp_path, PAIRS["survey"], "plan", *given)
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    said = " ".join(result.stderr.split())
    assert "--seed, --goal, --output: not for PDDL files" in said


def test_a_rover_sends_from_where_it_sampled(tmp_path: Path) -> None:
    found = planned(tmp_path, PAIRS["survey"])
    assert found == {"plan": ["(sample r hill)", "(send r hill hill camp)"]}


def test_a_plan_that_is_redirected_can_be_checked(tmp_path: Path) -> None:
    result = invoke(tmp_path, PAIRS["survey"], "plan")
    assert result.stdout == "(sample r hill)\n(send r hill hill camp)\n; cost = 2 (unit cost)\n"
    check(World.read(*PAIRS["survey"]), read_steps(result.stdout))
    assert result.stderr == "2 operators\n"


@pytest.mark.parametrize("name", PAIRS)
def test_the_field_reads_a_plan_that_is_redirected(tmp_path: Path, name: str) -> None:
    pytest.importorskip("unified_planning", reason="needs the extra 'up'")
    from unified_planning.engines import SequentialPlanValidator
    from unified_planning.io import PDDLReader

    printed = invoke(tmp_path, PAIRS[name], "plan").stdout
    reader = PDDLReader()
    task = reader.parse_problem_string(*PAIRS[name])
    for text, status in ((printed, "VALID"), ("", "INVALID")):
        read = reader.parse_plan_string(task, text)
        assert SequentialPlanValidator().validate(task, read).status.name == status


EARLIER = "sample(r, hill)\nsend(r, hill, hill, camp)\n"  # as slap plan wrote it before
COMPETITIONS = """; a plan as other planners write it
0.000: (SAMPLE r hill) [1.000]

(send r hill hill camp)
; cost = 2 (unit cost)
"""


def check_by_command(plan: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tools.check_plan", plan.with_name("domain.pddl")]
    return subprocess.run(
        [*command, plan.with_name("problem.pddl"), plan], capture_output=True, text=True, cwd=ROOT
    )


@pytest.mark.parametrize(
    ("plan", "code", "words"),
    [
        (COMPETITIONS, 0, "valid: 2 steps"),
        (EARLIER, 0, "valid: 2 steps"),
        ("sample(r, hill)\nsent hill\n", 1, "invalid: line 2 is no step: sent hill"),
        ("(send r hill hill camp)", 1, "invalid: step 1: (send r hill hill camp) is not poss"),
        (None, 2, "No such file or directory"),
    ],
    ids=["as others write", "as before", "no step", "not possible", "no file"],
)
def test_plans_of_others_are_checked(
    tmp_path: Path, plan: str | None, code: int, words: str
) -> None:
    for name, text in zip(("domain", "problem"), PAIRS["survey"], strict=True):
        (tmp_path / f"{name}.pddl").write_text(text, encoding="utf-8")
    if plan is not None:
        (tmp_path / "plan.txt").write_text(plan, encoding="utf-8")
    checked = check_by_command(tmp_path / "plan.txt")
    assert checked.returncode == code, checked.stderr
    assert words in checked.stdout + checked.stderr
    assert "Traceback" not in checked.stderr


def test_costs_are_minimised_and_said(tmp_path: Path) -> None:
    found = planned(tmp_path, PAIRS["haulage"])
    assert found["cost"] == 8
    assert "(drive t x y)" in found["plan"]
    result = invoke(tmp_path, PAIRS["haulage"], "plan")
    assert result.stdout.endswith("\n; cost = 8 (general cost)\n")
    assert "6 operators, cost 8, the least" in result.stderr


@pytest.mark.parametrize("planner", ["anytime", "ff", "astar"])
def test_a_cost_that_the_problem_forgets_is_said(tmp_path: Path, planner: str) -> None:
    domain = HAULAGE.replace("(total-cost) 2", "(total-cost) (miles ?p ?q)").replace(
        "(:functions", "(:functions (miles ?p ?q - place) - number"
    )
    problem = HAULAGE_TASK.replace("(motorway x z)", "")
    result = invoke(tmp_path, (domain, problem), "plan", "--planner", planner)
    assert result.exit_code == ErrorCode.UNSOLVABLE
    assert result.stderr.endswith(
        "; left out, as :init does not give what their cost is made of: (drive t x y) and 1 more\n"
    )


def test_a_goal_out_of_reach_names_what_nothing_achieves(tmp_path: Path) -> None:
    goal = "(and (sent hill) (at r camp) (not (at r hill)) (or (base camp) (sent camp)))"
    texts = SURVEY, SURVEY_TASK.replace("(sent hill)", goal)
    result = invoke(tmp_path, texts, "plan")
    assert result.exit_code == ErrorCode.UNSOLVABLE
    assert result.stderr.endswith(
        "nothing that can be done achieves at(r, camp), not at(r, hill)\n"
    )


def test_the_other_definition_is_named(tmp_path: Path) -> None:
    result = invoke(tmp_path, PAIRS["survey"][::-1], "plan")
    assert result.exit_code == ErrorCode.MALFORMED_PDDL
    assert "expected (define (domain NAME) ...), found a problem only" in result.stderr


def test_what_cannot_be_read_is_named_once_and_what_is_missing_said(tmp_path: Path) -> None:
    result = slap("plan", tmp_path / "nope.pddl")
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert result.stderr.endswith("nope.pddl: No such file or directory\n")
    (tmp_path / "domain.pddl").write_text(SURVEY, encoding="utf-8")
    result = slap("plan", tmp_path / "domain.pddl")
    assert "found a domain only; give the problem's file after" in result.stderr


def test_both_definitions_in_one_file(tmp_path: Path) -> None:
    file = tmp_path / "both.pddl"
    file.write_bytes("\n".join(PAIRS["survey"]).encode("utf-8-sig"))
    result = slap("plan", file, "--json")
    assert result.exit_code == 0, result.stderr
    assert len(json.loads(result.stdout)["plan"]) == 2


def test_unknown_planners_are_named(tmp_path: Path) -> None:
    result = invoke(tmp_path, PAIRS["survey"], "plan", "--planner", "exhaustive")
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert "lazy, ff, astar and up:NAME" in " ".join(result.stderr.split())


def test_proposed_operators_follow_the_standard(tmp_path: Path) -> None:
    """An operator is sound that is needed with one object for two parameters."""
    output = tmp_path / "proposal"
    result = invoke(tmp_path, PAIRS["survey"], "propose", "--output", str(output))
    assert result.exit_code == 0, result.stderr
    assert "send(r, hill, hill, camp)" in " ".join(result.stdout.split())
    written = [
        (output / name).read_text(encoding="utf-8") for name in ("domain.pddl", "problem.pddl")
    ]
    stated = parse_domain(written[0])
    found = find_pddl_plan(stated, parse_problem(written[1], stated))
    assert len(found.steps) == 2


def test_operators_of_a_file_may_be_in_capitals(tmp_path: Path) -> None:
    file = tmp_path / "operators.pddl"
    file.write_text(f"; by hand\n{SURVEY.replace('(define (', '(DEFINE (')}", encoding="utf-8")
    result = invoke(tmp_path, PAIRS["survey"], "propose", "--operators", str(file))
    assert result.exit_code == 0, result.stderr


def test_operators_of_a_file_may_say_that_parameters_differ(tmp_path: Path) -> None:
    apart = "(and (not (= ?what ?here)) (sampled ?r ?what)"
    file = tmp_path / "operators.pddl"
    file.write_text(SURVEY.replace("(and (sampled ?r ?what)", apart), encoding="utf-8")
    result = invoke(tmp_path, PAIRS["survey"], "propose", "--operators", str(file))
    assert result.exit_code == ErrorCode.PROPOSAL_REJECTED
    file.write_text(SURVEY, encoding="utf-8")
    assert invoke(tmp_path, PAIRS["survey"], "propose", "--operators", str(file)).exit_code == 0


def test_what_no_skill_is_learned_for_is_named(tmp_path: Path) -> None:
    domain = SURVEY.replace("(at ?r ?s) :effect", "(not (sampled ?r ?s)) :effect")
    result = invoke(tmp_path, (domain, SURVEY_TASK), "propose")
    assert result.exit_code == ErrorCode.INVALID_DOMAIN
    message = " ".join(result.stderr.split())
    assert "domain.pddl:4:12: operator sample has a precondition with a negation" in message


# -- engines of unified-planning ------------------------------------------------------------------


@pytest.mark.parametrize("name", PAIRS)
def test_an_engine_of_the_field_finds_plans_of_the_same_kind(tmp_path: Path, name: str) -> None:
    pytest.importorskip("up_aries", reason="needs the extra 'up'")
    texts = PAIRS[name]
    theirs = planned(tmp_path, texts, "--planner", "up:aries")
    ours = planned(tmp_path, texts, "--planner", "astar")
    cost = check(World.read(*texts), read_steps("\n".join(theirs["plan"])))
    assert theirs.get("cost", cost) == cost
    if "cost" in ours:
        assert ours["cost"] <= cost
    else:
        assert len(ours["plan"]) <= len(theirs["plan"])


LAMP = """(define (domain lamp) (:requirements :durative-actions) (:predicates (lit))
  (:durative-action light :parameters () :duration (= ?duration 2) :condition () :effect
    (at end (lit))))"""
LIT = "(define (problem lit) (:domain lamp) (:init) (:goal (lit)))"


def test_a_plan_in_time_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("up_aries", reason="needs the extra 'up'")
    result = invoke(tmp_path, (LAMP, LIT), "plan", "--planner", "up:aries")
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert "no sequence of operators, as of durative actions" in " ".join(result.stderr.split())


def test_an_unknown_engine_is_named(tmp_path: Path) -> None:
    pytest.importorskip("unified_planning", reason="needs the extra 'up'")
    result = invoke(tmp_path, PAIRS["survey"], "plan", "--planner", "up:nobody")
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    told = " ".join(result.stderr.split())
    assert "no engine 'nobody'" in told
    assert "validator" not in told  # that is no planner


def test_without_the_extra_it_is_said_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "unified_planning.environment", None)
    result = invoke(tmp_path, PAIRS["survey"], "plan", "--planner", "up:aries")
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert "pip install 'slap_ros[up]'" in " ".join(result.stderr.split())
