# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain without operators and skills: what can be done with it, and what is said where not."""

import json
from dataclasses import replace

import pytest

from slap_ros.core import task_with_goal
from slap_ros.domain_check import check_domain
from slap_ros.domains import get_domain
from slap_ros.errors import (
    ErrorCode,
    InvalidParameterError,
    NoSkillsError,
    UnknownGoalError,
    UnsolvableError,
)
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import ground_options
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.scripted_skill import with_scripts
from support import untaught
from support.slap_command import slap

DOMAIN = untaught.make()
TAUGHT = get_domain("obstacle2d")


@pytest.fixture
def installed(install):
    install({"untaught": "support.untaught:make"})


def test_a_choice_of_skills_changes_operators_and_nothing_that_is_perceived(installed):
    state = DOMAIN.task(0).initial_state
    seen = {}
    for skills in ("", "none", "demonstrator"):
        domain = open_domain(DomainChoice("untaught", skills=skills))
        space = domain.atom_space(state)
        seen[skills] = [str(atom) for atom in space.decode(space.abstract(state))]
        assert bool(domain.operators) == (skills == "demonstrator") == bool(domain.skills)
    assert seen[""] == seen["none"] == seen["demonstrator"]
    bare = open_domain(DomainChoice("obstacle2d", skills="none"))
    assert bare.static_predicates == TAUGHT.static_predicates


def test_skills_that_do_not_exist_are_refused(installed):
    with pytest.raises(InvalidParameterError, match="unknown skills 'some'; there are none, demon"):
        DomainChoice("untaught", skills="some")
    with pytest.raises(InvalidParameterError, match="obstacle2d has no demonstrator"):
        open_domain(DomainChoice("obstacle2d", skills="demonstrator"))
    without = replace(DOMAIN.acquisition, scripts={})
    with pytest.raises(InvalidParameterError, match=r"no script for Pick, "):
        with_scripts(replace(DOMAIN, acquisition=without))


def test_the_demonstrator_does_what_the_scripts_do():
    domain = with_scripts(DOMAIN)
    for seed in range(5):
        shown = demonstrate(domain, domain.task(seed))
        assert shown.episode.success, shown.episode.error
        assert len(shown.trace) == shown.episode.plan_length + 1
        assert domain.task(seed).goal <= shown.trace[-1]


def test_what_failed_is_told_and_planned_for_again():
    """A script that ends at once the first two times, wherever it is begun."""
    failed = []

    def tired(state, objects):
        if len(failed) < 2:
            failed.append(objects)
            return lambda _: None
        return DOMAIN.acquisition.scripts["Pick"](state, objects)

    scripts = {**DOMAIN.acquisition.scripts, "Pick": tired}
    domain = with_scripts(replace(DOMAIN, acquisition=replace(DOMAIN.acquisition, scripts=scripts)))
    episode = demonstrate(domain, domain.task(0)).episode
    assert episode.success
    assert episode.replans == 2
    failures = [(edge.option, edge.steps) for edge in episode.edges if not edge.reached]
    assert failures == [("Pick", 0)] * 2


def test_astar_takes_the_fewest_operators_and_tries_none():
    task = TAUGHT.task(0)
    space = TAUGHT.atom_space(task.initial_state)
    goal = space.mask(task.goal)
    ours = SymbolicPlanner(space, ground_options(TAUGHT, space)).plan(task.initial_state, goal)
    named = make_planner("astar", TAUGHT, task.initial_state).plan(task.initial_state, goal)
    shortest = make_planner("exhaustive", TAUGHT, task.initial_state).plan(task.initial_state, goal)
    assert list(map(str, ours.plan.edges)) == list(map(str, named.plan.edges))
    assert len(ours.plan.edges) <= len(shortest.plan.edges)
    assert ours.edges_rolled_out == 0
    assert ours.plan.edges[-1].target.required & goal == goal
    with pytest.raises(UnsolvableError, match="no operator leads to On"):
        SymbolicPlanner(space, ()).plan(task.initial_state, goal)


def test_planners_say_that_there_is_nothing_to_plan_with():
    with pytest.raises(NoSkillsError, match="untaught has no skills yet"):
        make_planner("lazy", DOMAIN, DOMAIN.task(0).initial_state)


def test_goals_by_name_and_in_atoms():
    by_name = task_with_goal(DOMAIN, 3, 0, "other")
    assert {str(atom) for atom in by_name.goal} == {"Holding(robot, block2)"}
    in_atoms = task_with_goal(DOMAIN, 3, 0, "(Holding robot block2)")
    assert in_atoms.goal == by_name.goal
    assert task_with_goal(DOMAIN, 3).goal == DOMAIN.task(3).goal
    with pytest.raises(UnknownGoalError, match="no goal 'tests'; there are training, other"):
        task_with_goal(DOMAIN, 3, 0, "tests")


def test_plan_with_hand_written_operators_alone(installed, tmp_path):
    ran = slap("plan", "untaught", "--goal", "other", "--output", str(tmp_path / "plan"))
    assert ran.exit_code == 0, ran.output
    assert "hand-written ones, as untaught has no skills yet" in ran.stderr
    files = [str(tmp_path / "plan" / name) for name in ("domain.pddl", "problem.pddl")]
    symbolic = slap("plan", *files, "--json")
    planned = slap("plan", "untaught", "--goal", "other", "--json")
    steps = json.loads(planned.stdout)["plan"]
    assert len(steps) == len(json.loads(symbolic.stdout)["plan"]) > 0


def test_plan_with_the_scripts_predicts_steps(installed):
    ran = slap("plan", "untaught", "--skills", "demonstrator", "--json")
    own = slap("plan", "obstacle2d", "--shortcuts", "none", "--json")
    assert json.loads(ran.stdout)["plan"] == json.loads(own.stdout)["plan"]


@pytest.mark.parametrize("command", ["run", "evaluate", "train"])
def test_commands_that_need_skills_say_so_before_anything_starts(installed, command):
    ran = slap(command, "untaught")
    assert ran.exit_code == ErrorCode.NO_SKILLS
    assert "untaught has no skills yet" in ran.stderr
    assert "Traceback" not in ran.stderr


def test_a_goal_that_no_domain_has_is_refused_by_name(installed):
    for command in ("plan", "run", "propose"):
        ran = slap(command, "untaught", "--goal", "nonsense")
        assert ran.exit_code == ErrorCode.UNKNOWN_GOAL, ran.output
        assert "there are training, other" in ran.stderr


def test_domains_shows_what_skills_are_acquired_with(installed):
    shown = slap("domains", "untaught").stdout
    assert "training\n" in shown
    assert "hand-written operators, without skills; a demonstrator has scripts" in shown
    data = json.loads(slap("domains", "untaught", "--json").stdout)
    assert set(data["goals"]) == {"training", "other"}
    assert data["goals"]["other"] == "Holding(robot, block2)"
    assert not data["operators"]
    assert {one["name"] for one in data["hand_written_operators"]} == set(data["demonstrator"])
    listed = json.loads(slap("domains", "--json").stdout)
    assert data in listed


@pytest.mark.slow
def test_check_tries_the_demonstrator_and_the_goals():
    found = {one.name: one for one in check_domain(DOMAIN, 0, 3, 40)}
    assert found["demonstrator"].found.startswith("all 3 tasks, in ")
    assert found["goals"].found.startswith("operators in a shortest plan: training ")
    assert (found["rewards"].status, found["scripts"].status) == ("warning", "ok")
    assert found["skills"].found != "0 roll-outs repeated, to the bit"
    holding = replace(DOMAIN, goals={"now": lambda state: frozenset()})
    wrong = {one.name: one for one in check_domain(holding, 0, 1, 10)}["goals"]
    assert (wrong.status, wrong.found.split(" of ")[0]) == ("problem", "now holds at the start")
    alone = replace(DOMAIN, acquisition=None)
    nothing = {one.name: one for one in check_domain(alone, 0, 1, 10)}["demonstrator"]
    assert (nothing.status, nothing.found[:17]) == ("warning", "no task was tried")


def study(name, folder, *arguments):
    """A study's data; the page is there too."""
    ran = slap("study", name, "untaught", *arguments, "--output", str(folder))
    assert ran.exit_code == 0, ran.output
    assert (folder / f"{name}_untaught.md").read_text().startswith("# ")
    assert not list(folder.glob(".*"))  # nothing is left of what it had done so far
    return json.loads((folder / f"{name}_untaught.json").read_text())


@pytest.mark.slow
def test_study_of_demonstrations(installed, tmp_path):
    counts = ["--tasks", "3", "--others", "2"]
    data = study("demonstrations", tmp_path, *counts)
    training, other = data["found"]["goals"]
    assert (training["goal"], len(training["tasks"])) == ("training", 3)
    assert (other["goal"], len(other["tasks"])) == ("other", 2)
    assert training["success_rate"] == other["success_rate"] == 1.0
    assert training["success_interval"]["low"] == pytest.approx(0.4385, abs=1e-4)
    again = study("demonstrations", tmp_path, *counts, "--jobs", "2")
    assert data["found"] == again["found"]
    alone = study("demonstrations", tmp_path / "alone", *counts, "--goal", "other")
    (alone,) = alone["found"]["goals"]
    assert len(alone["tasks"]) == 3


def test_a_study_goes_on_where_it_was_stopped(installed, tmp_path):
    log = tmp_path / ".demonstrations_untaught.jsonl"
    arguments = ["--goal", "other", "--preset", "fair", "--tasks", "2", "--others", "50"]
    command = f"slap study demonstrations untaught {' '.join([*arguments, '--seed', '500'])}"
    known = {"index": 0, "success": True, "steps": 777, "replans": 0, "begun": {}, "failed": {}}
    settings = {"preset": "fair", "tasks": 2, "others": 50, "seed": 500}
    entries = [
        {"command": command, "settings": settings},
        {"job": "other: seed 500, task 0", "result": {**known, "reason": ""}},
    ]
    log.write_text("".join(json.dumps(entry) + "\n" for entry in entries) + '{"job": "oth')
    (goal,) = study("demonstrations", tmp_path, *arguments)["found"]["goals"]
    assert [task["steps"] == 777 for task in goal["tasks"]] == [True, False]
    (tmp_path / "demonstrations_untaught.json").unlink()
    log.write_text(json.dumps({"command": "slap study demonstrations untaught --seed 9"}) + "\n")
    ran = slap("study", "demonstrations", "untaught", "--output", str(tmp_path))
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER
    assert "--seed 9` has done so far" in ran.stderr


def test_a_study_that_is_refused_leaves_nothing_behind(installed, tmp_path):
    ran = slap(
        "study", "demonstrations", "untaught", "--goal", "x", "--output", str(tmp_path / "results")
    )
    assert ran.exit_code == ErrorCode.UNKNOWN_GOAL
    assert not list(tmp_path.glob("results/*"))


@pytest.mark.slow
def test_study_of_vacuity_counts_what_policies_do_without_eyes(installed, tmp_path):
    data = study("vacuity", tmp_path, "--starts", "4")
    operators = {one["operator"]: one for one in data["found"]["operators"]}
    assert "Pick" in operators
    assert set(operators) | set(data["found"].get("without_starts", ())) == {
        operator.name for operator in TAUGHT.operators
    }
    for one in operators.values():
        assert 0 < one["starts"] <= 4
        assert [policy["policy"] for policy in one["policies"]] == [
            "nothing",
            "open",
            "close",
            "random",
        ]
    assert not any(one["policies"][0]["successes"] for one in operators.values())
    assert data["found"] == study("vacuity", tmp_path, "--starts", "4", "--jobs", "2")["found"]


def test_studies_need_a_demonstrator(tmp_path):
    for name in ("demonstrations", "vacuity"):
        ran = slap("study", name, "obstacle2d", "--output", str(tmp_path))
        assert ran.exit_code == ErrorCode.INVALID_PARAMETER
        assert "obstacle2d has no demonstrator" in ran.stderr


def test_study_of_induction_compares_with_hand_written_operators(installed, tmp_path):
    counts = ["--demonstrations", "1", "--demonstrations", "6", "--tasks", "3"]
    few, many = study("induction", tmp_path, *counts)["found"]["inductions"]
    assert (few["demonstrations"], many["demonstrations"]) == (1, 6)
    assert len(few["operators"]) <= len(many["operators"])
    assert set(many["too_many"]) <= {one["operator"].split("(")[0] for one in many["operators"]}
    for goal in many["goals"]:
        assert len(goal["shortest"]) == 3
        assert all(length is None or length >= 1 for length in goal["lengths"])
    other = next(goal for goal in many["goals"] if goal["goal"] == "other")
    assert other["as_short"] == sum(
        a == b for a, b in zip(other["lengths"], other["shortest"], strict=True)
    )


def propose(*arguments):
    return slap("propose", "untaught", *arguments)


def test_propose_records_its_own_demonstrations(installed):
    ran = propose("--proposer", "induced", "--demonstrations", "3", "--goal", "other", "--json")
    assert ran.exit_code == 0, ran.output
    proposal = json.loads(ran.stdout)["proposal"]
    source = proposal["provenance"]["source"]
    assert source == "demonstrations: 3, from the domain's demonstrator"
    assert proposal["plan"]
    assert (
        ran.stdout
        == propose(
            "--proposer", "induced", "--demonstrations", "3", "--goal", "other", "--json"
        ).stdout
    )


def test_propose_takes_what_people_wrote(installed):
    proposal = json.loads(propose("--json").stdout)["proposal"]
    assert [one["name"] for one in proposal["operators"]] == [o.name for o in TAUGHT.operators]
    ran = propose("--rewarder", "manual")
    assert ran.exit_code == ErrorCode.INVALID_DOMAIN
    assert "no reward was written by hand for Pick; use the rewarder composed" in ran.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--demonstrations", "3"], "--demonstrations are for --proposer induced"),
        (["--proposer", "induced", "--demonstrations", "0"], "is one number, at least 1, or bags"),
        (
            ["--proposer", "induced", "--demonstrations", "3", "--demonstrations", "4"],
            "is one number, at least 1, or bags: not 3, 4",
        ),
    ],
)
def test_propose_refuses_demonstrations_that_cannot_be(installed, arguments, said):
    ran = propose(*arguments)
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER
    assert said in ran.stderr


def test_propose_needs_a_demonstrator_to_record(installed):
    ran = slap("propose", "obstacle2d", "--proposer", "induced")
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER
    assert "--demonstrations BAG here: domain obstacle2d has no demonstrator" in ran.stderr


def test_evaluate_the_demonstrator_for_a_goal(installed):
    arguments = ["--skills", "demonstrator", "--goal", "other", "--tasks", "2", "--seeds", "1"]
    ran = slap("evaluate", "untaught", *arguments, "--planner", "astar", "--json")
    assert ran.exit_code == 0, ran.output
    figures = json.loads(ran.stdout)
    assert figures["success_rate"] == 1.0
    shown = [demonstrate(with_scripts(DOMAIN), DOMAIN.task(0, i, "other")) for i in range(2)]
    steps = [one.episode.plan_length for one in shown]
    assert figures["plan_length"]["mean"] == pytest.approx(sum(steps) / 2)
