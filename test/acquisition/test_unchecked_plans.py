# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model's plans without search and checks: what clones make of them, and what is no plan."""

import json
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import ErrorCode
from slap_ros.imitation.unchecked_plans import carry_out_unchecked
from slap_ros.language.budget import BudgetLimits
from slap_ros.language.cassette import open_client
from slap_ros.relational import LiftedAtom
from slap_ros.skills.acquired_domain import acquired_domain
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.skills.skill_library import SkillLibrary
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.imitation import study
from slap_ros.studies.lg_sail.model_attempts import LanguageModel, attempt_unchecked_plan
from slap_ros.studies.results import Provenance
from slap_ros.studies.study_log import StudyLog
from support.model_answers import SETTINGS, decomposition_json, operator_json, plan_json
from support.points import AT, HAND_EMPTY, PICK, POINTS, PUT, P, T
from support.scripted_server import Step, serving
from support.steady_skills import PICKING, PUTTING, write_library

# A model's own names, and a forgotten HandEmpty: with these operators A* finds no plan.
GRASP = replace(PICK, name="Grasp")
BRING = replace(PUT, name="Bring", add_effects=frozenset({LiftedAtom(AT, (T, P))}))
STEPS = ["Grasp(thing0)", "Bring(thing0, place0)", "Grasp(thing1)", "Bring(thing1, place1)"]


@pytest.fixture(scope="module")
def domain():
    return acquired_domain(POINTS, SkillLibrary(POINTS.name, (PICKING, PUTTING)))


def script(operators=(GRASP, BRING), steps=STEPS):
    answers = {f"operator {one.name}": [Step(operator_json(one))] for one in operators}
    plan = {"plan": [Step(plan_json(steps))]}
    return {"decomposition": [Step(decomposition_json(operators))]} | answers | plan


def model_at(url):
    settings = replace(SETTINGS, base_url=url)
    return LanguageModel(open_client("live", settings), settings)


def carried_out(domain, answers):
    """What comes of a task with answers by script, and how many questions were asked."""
    task = domain.task(300, 0)
    with serving(answers) as server:
        inquiry = model_at(server.url).inquiry(0, BudgetLimits())
        _, plan = attempt_unchecked_plan(inquiry, AcquisitionProblem.of_task(domain, task))
    rollout = carry_out_unchecked(domain, task, 0, plan, domain.skills)
    return rollout, len(server.requests)


def test_a_plan_is_carried_out_by_the_skills_that_add_what_it_says(domain):
    rollout, questions = carried_out(domain, script())
    assert [stage.operator for stage in rollout.stages] == ["Pick", "Put", "Pick", "Put"]
    assert rollout.plan == tuple(STEPS)
    assert (rollout.progress, rollout.unplanned, questions) == (1.0, "", 4)


def test_an_action_that_is_named_twice_is_asked_for_once(domain):
    answers = script() | {"decomposition": [Step(decomposition_json((GRASP, BRING, GRASP)))]}
    rollout, questions = carried_out(domain, answers)
    assert (rollout.progress, questions) == (1.0, 4)


def test_of_an_operator_what_can_be_read_is_taken(domain):
    """Its checks would refuse both: an atom of an invented predicate, and one of a variable."""
    grasp = json.loads(operator_json(GRASP))
    grasp["preconditions"].append({"predicate": "Shiny", "arguments": ["?thing"]})
    grasp["add_effects"].append({"predicate": "At", "arguments": ["?thing", "?nowhere"]})
    rollout, _ = carried_out(domain, script() | {"operator Grasp": [Step(json.dumps(grasp))]})
    assert rollout.progress == 1.0


def test_a_plan_that_ends_too_early_is_not_solved(domain):
    rollout, _ = carried_out(domain, script(steps=STEPS[:2]))
    assert all(stage.done for stage in rollout.stages)
    assert rollout.unplanned == "goal not reached: At(thing1, place1)"
    assert rollout.progress == 0.0


@pytest.mark.parametrize(
    "step", ["Bring(place0, thing0)", "Bring(thing0)", "Grasp(thing9)", "Throw(thing0)"]
)
def test_a_step_that_no_skill_carries_out_ends_the_plan(domain, step):
    rollout, _ = carried_out(domain, script(steps=[STEPS[0], step, *STEPS[1:]]))
    assert len(rollout.stages) == 1
    assert (rollout.progress, rollout.unplanned) == (0.0, f"no such skill: {step}")


def test_an_operator_that_adds_nothing_of_what_a_skill_adds_is_none(domain):
    empty = frozenset({LiftedAtom(HAND_EMPTY, ())})
    idle = replace(GRASP, add_effects=empty, delete_effects=frozenset())
    rollout, _ = carried_out(domain, script((idle, BRING)))
    assert rollout.unplanned == "no such skill: Grasp(thing0)"


def test_a_step_in_the_wrong_place_fails_as_a_stage_does(domain):
    """Nothing checks before that there is something to put down."""
    rollout, _ = carried_out(domain, script(steps=STEPS[1:]))
    assert rollout.failure.operator == "Put"
    assert (rollout.progress, rollout.unplanned) == (0.0, "")


@pytest.mark.parametrize("subject", ["decomposition", "operator Bring", "plan"])
def test_an_answer_that_cannot_be_read_ends_the_attempt(domain, subject):
    rollout, questions = carried_out(domain, script() | {subject: [Step("I cannot tell.")]})
    word = subject.partition(" ")[0]
    assert rollout.unplanned.startswith(f"answer not read: {word}: ")
    assert (rollout.progress, rollout.stages) == (0.0, ())
    assert questions == {"decomposition": 1, "operator": 3, "plan": 4}[word]


# -- the study ------------------------------------------------------------------------------------


class Silent:
    """Shows no progress."""

    def begin(self, what, total): ...

    def advance(self): ...

    def report_failure(self, complaint): ...


@pytest.mark.slow
@pytest.mark.timeout(120)  # clones both skills with as many updates as figures have
@pytest.mark.usefixtures("points_installed")
def test_the_study_names_the_model_beside_its_figures(tmp_path):
    choice = DomainChoice("points", "two", str(write_library(tmp_path / "steady")))
    runner = JobRunner(StudyLog(tmp_path / "log", Provenance("points", "", {})), 1, Silent())
    with serving(script()) as good, serving(script(steps=STEPS[:1])) as bad:
        models = {"good": model_at(good.url), "bad": model_at(bad.url)}
        report = study([choice], [12], [""], (2, 300), models, runner)
    solved = {(row["method"], row["model"]): row["solved"] for row in report.found["rows"]}
    assert solved == {
        ("lg_sail", ""): 1.0,
        ("tamp_imitation", ""): 1.0,
        ("language_imitation", "good"): 1.0,
        ("language_imitation", "bad"): 0.0,
    }
    cells = [row for row in report.table.rows if "`language_imitation` (bad)" in row]
    assert [row[6] for row in cells] == ["goal not reached 2"]
    assert "was not run" not in report.measured


@pytest.mark.usefixtures("points_installed")
def test_what_a_script_says_is_refused_and_nothing_is_written(tmp_path):
    library = write_library(tmp_path / "steady")
    words = ["study", "imitation", "points", "--library", library, "--output", tmp_path / "out"]
    with serving(script()) as server:
        ran = CliRunner().invoke(
            app, [*map(str, words), "--model", "m", "--base-url", server.url, "--tasks", "1"]
        )
    assert ran.exit_code == ErrorCode.INVALID_CASSETTE
    assert "no result of a study" in " ".join(ran.stderr.split())
    assert not (tmp_path / "out" / "imitation_points.json").exists()
    ran = CliRunner().invoke(app, [*map(str, words), "--base-url", server.url])
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER
    assert "need --model" in " ".join(ran.stderr.split())
