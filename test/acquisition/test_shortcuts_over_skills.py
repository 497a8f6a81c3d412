# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts that are learned over acquired skills: both halves in one plan."""

import json
import math
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ensemble.observation import Episode
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from slap_ros.acquisition.curriculum.after_shortcuts import AfterShortcuts
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.api.growing import GrowthWatch, TrainingNotes, grow_rounds
from slap_ros.api.growth import GrowthRequest, GrowthRound, TriedShortcut
from slap_ros.api.growth_page import growth_page
from slap_ros.api.shortcut_choice import choose_library
from slap_ros.api.training import Unwatched
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidParameterError, SkillsChangedError, UnsolvableError
from slap_ros.evaluation.approaches import PURE_PLANNING, approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.relational import State
from slap_ros.relational.pddl import parse_goal
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.library_choice import LibraryChoice
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import chosen_library, require_usable
from slap_ros.shortcuts.shortcut_library import load_library, save_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.slap.planning_time import plan_once
from support.points import REWARDS
from support.points_training import SMALL
from support.slap_command import slap
from support.steady_skills import PICKING, PUTTING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
CHANGES = [word for change in SMALL for word in ("--set", change)]


def train(skills, output, *more):
    """In processes of its own, which open the library by themselves."""
    return slap(
        "train", "points", "--preset", "line", "--skills", skills, "--output", output,
        "--jobs", 1, "--json", *CHANGES, *more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """Room for what is trained once for all tests here."""
    return SimpleNamespace(folder=tmp_path_factory.mktemp("learned"), answer=None)


@pytest.fixture
def trained(learned):
    if learned.answer is None:
        write_library(learned.folder / "steady")
        learned.answer = train(learned.folder / "steady", learned.folder / "library")
    assert learned.answer.exit_code == 0, learned.answer.output
    return learned


def test_a_shortcut_over_acquired_skills_is_found_learned_and_recorded(trained):
    record = json.loads(trained.answer.stdout)
    assert record["validation"]["slap"] < 0.6 * record["validation"]["pure_planning"]
    domain = open_domain(DomainChoice("points", "line", str(trained.folder / "steady")))
    digest = domain.configuration["skills_digest"]
    assert record["skills"] == {"name": "steady", "digest": digest, "skills": ["Pick", "Put"]}
    assert "--skills" in record["command"] and f"--skills {trained.folder}" not in record["command"]
    place = json.loads((trained.folder / "library-training" / "settings.json").read_text())["place"]
    assert place == {"domain": "points", "preset": "line", "skills": digest, "seed": 0}


def test_a_plan_has_acquired_skills_and_shortcuts(trained):
    """In tasks of two things, of which the shortcut, learned with one, moves one."""
    answer = slap(
        "plan", "points", "--preset", "long_line", "--skills", trained.folder / "steady",
        "--shortcuts", trained.folder / "library", "--json",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    (shortcut,) = load_library(trained.folder / "library", get_domain("points", "line")).shortcuts
    options = [edge["option"] for edge in json.loads(answer.stdout)["plan"]]
    assert [option.split("(")[0] for option in options] == ["Pick", "Put", shortcut.name]


def test_shortcuts_over_other_skills_are_refused_with_both_digests(trained, tmp_path):
    """Skills that act alike are the same wherever they are; others are not, nor are none."""
    library = trained.folder / "library"
    elsewhere = shutil.copytree(trained.folder / "steady", tmp_path / "elsewhere")
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    domains = [open_domain(DomainChoice("points", "line", str(at))) for at in (elsewhere, slower)]
    same, other = (domain.configuration["skills_digest"] for domain in domains)
    assert chosen_library(str(library), domains[0]).skills_digest == same
    require_usable(str(library))  # before any skills are known
    for use in ("plan", "evaluate"):
        answer = slap(
            use, "points", "--preset", "line", "--skills", slower, "--shortcuts", library
        )  # fmt: skip
        assert answer.exit_code == ErrorCode.SKILLS_CHANGED, answer.output
        assert same in answer.stderr and other in answer.stderr
    with pytest.raises(SkillsChangedError, match=f"{same}.*not acquired"):
        chosen_library(str(library), get_domain("points", "line"))
    with pytest.raises(SkillsChangedError, match=f"{same}.*{other}"):
        choose_library(load_library(library, domains[1]), domains[1], "lazy", print)


def test_shortcuts_that_ship_are_used_with_their_skills_alone(trained, tmp_path, monkeypatch):
    shutil.copytree(
        trained.folder / "library", tmp_path / "share/slap_ros/models/shortcuts/points"
    )  # fmt: skip
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    steady = open_domain(DomainChoice("points", "line", str(trained.folder / "steady")))
    assert chosen_library("", steady).shortcuts
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    assert chosen_library("", open_domain(DomainChoice("points", "line", str(slower)))) is None


def test_a_node_takes_shortcuts_up_with_the_skills_of_the_episode(trained, tmp_path):
    """Skills may be announced later, and others again: what was loaded before does not count."""
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    steady, other = (
        open_domain(DomainChoice("points", "line", str(at)))
        for at in (trained.folder / "steady", slower)
    )
    parameters = ShortcutParameters(shortcuts=str(trained.folder / "library"))
    provider = ShortcutProvider(None, parameters)  # a node is told what is left out: nothing is
    provider.prepare(get_domain("points", "line"))
    for _ in range(2):
        provider.prepare_episode(episode_of(steady))
        assert provider.shortcuts(steady) and provider.provenance(steady)["library"]
        with pytest.raises(SkillsChangedError):
            provider.prepare_episode(episode_of(other))
        assert not provider.shortcuts(other) and not provider.provenance(other)["library"]


def episode_of(domain):
    task = domain.task(0)
    return Episode(1, 0, domain, task, domain.atom_space(task.initial_state))


def check(library, skills, *more):
    return slap(
        "check", "points", "--shortcuts", library, "--skills", skills, "--tasks", 2, *more
    )  # fmt: skip


def contents(folder):
    return {
        path.relative_to(folder): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_sources_that_were_changed_are_named(trained, tmp_path):
    library = shutil.copytree(trained.folder / "library", tmp_path / "library")
    file = library / "library.json"
    about = json.loads(file.read_text())
    warnings = []
    for revision in ("0123456789ab", "0123456789ab-dirty"):
        about["versions"]["revision"] = revision
        file.write_text(json.dumps(about))
        answer = check(library, trained.folder / "steady")
        assert answer.exit_code == 0, answer.output
        warnings.append("by 0123456789ab-dirty: sources with changes" in answer.stderr)
    assert warnings == [False, True]


def test_shortcuts_that_hold_over_other_skills_are_used_with_them(trained, tmp_path):
    """And with no others; whoever uses them is told both digests."""
    library = shutil.copytree(trained.folder / "library", tmp_path / "library")
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    before, first = contents(library), load_library(library, get_domain("points", "line"))
    answer = check(library, slower)
    assert answer.exit_code == 0, answer.output
    domain = open_domain(DomainChoice("points", "line", str(slower)))
    both = [first.skills_digest, domain.configuration["skills_digest"]]
    assert all(digest in " ".join(answer.output.split()) for digest in both)
    after = contents(library)
    assert {name for name in after if after[name] != before.get(name)} == {Path("library.json")}
    told = []
    assert choose_library(str(library), domain, "lazy", told.append).shortcuts
    assert all(digest in told[0] for digest in both)
    with pytest.raises(SkillsChangedError):
        chosen_library(str(library), get_domain("points", "line"))
    again = check(library, slower, "--json")
    assert json.loads(again.stdout)["holds"] and contents(library) == after


def failing(library):
    """The library with a policy that stays where it is."""

    def lame(policy):
        layers = tuple((weights * 0, bias * 0) for weights, bias in policy.layers)
        return replace(policy, layers=layers, log_std=policy.log_std * 0 - 9)

    shortcuts = tuple(replace(s, policy=lame(s.policy)) for s in library.shortcuts)
    return replace(library, shortcuts=shortcuts)


def test_shortcuts_that_fail_over_other_skills_stay_unused_and_untouched(trained, tmp_path):
    library, points = tmp_path / "library", get_domain("points", "line")
    save_library(library, failing(load_library(trained.folder / "library", points)))
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    before = contents(library)
    answer = check(library, slower)
    assert answer.exit_code == ErrorCode.SKILLS_CHANGED, answer.output
    assert "does not hold over" in " ".join(answer.output.split()) and contents(library) == before
    assert check(library, slower, "--json").exit_code == ErrorCode.SKILLS_CHANGED


def test_what_was_checked_is_the_shortcuts_that_were_there(trained, tmp_path):
    """Others in their place count as unchecked, and a record that is damaged as none."""
    library, points = tmp_path / "library", get_domain("points", "line")
    held = load_library(trained.folder / "library", points)
    other = "0123456789abcdef"
    checked = held.checked({"skills_digest": other, "library": held.digest})
    assert checked.usable_over(other) and checked.usable_over(held.skills_digest)
    assert not failing(checked).usable_over(other)
    for damaged in (None, 3, [3], {"skills_digest": other}, [{"skills_digest": other}]):
        save_library(library, replace(held, record={**held.record, "checked": damaged}))
        assert not load_library(library, points).usable_over(other)


@pytest.mark.slow
def test_shortcuts_that_always_fail_leave_the_plans_of_the_skills(trained):
    """To the step, in each of several tasks; and the paper's search finds the same lengths."""
    domain = open_domain(DomainChoice("points", "line", str(trained.folder / "steady")))
    library = load_library(trained.folder / "library", domain)
    alone, _, with_shortcuts = approaches(library, DEFAULT)
    _, _, lame = approaches(failing(library), DEFAULT)
    for index in range(3):
        task, lengths = domain.task(500, index), {}
        for planner in ("lazy", "exhaustive"):
            made = [solve(domain, task, each, planner) for each in (alone, with_shortcuts, lame)]
            assert all(episode.success for episode in made)
            lengths[planner] = [episode.plan_length for episode in made]
        assert lengths["lazy"] == lengths["exhaustive"]
        skills, shorter, same = lengths["lazy"]
        assert skills == same > shorter


THEN_PICK = "(and (At thing0 place0) (Holding thing1))"  # the shortcut first, and a skill then


def after_shortcuts(trained, *skills):
    """The skills that a search tries where the shortcut has led."""
    points = get_domain("points", "long_line")
    digest = load_library(trained.folder / "library", points).digest
    shortcuts = LibraryChoice(trained.folder / "library", digest)
    by_name = {skill.operator.name: skill for skill in skills}
    task = task_with_goal(points, 0, 1, THEN_PICK)
    return AfterShortcuts(shortcuts, by_name, REWARDS).roll_out(points, task, 1)


def test_a_skill_that_fails_where_a_shortcut_has_led_is_learned_from_there(trained):
    """Each is a plan of its own, of one stage; with skills that work, none of these fails."""
    found = after_shortcuts(trained, PICKING, PUTTING)
    assert found and all(rollout.progress == 1.0 for rollout in found)
    assert {rollout.plan for rollout in found} == {("Pick(thing1)",)}
    lame = replace(PICKING, policy=towards(0, False, gain=0.0))
    failed = InitiationStates.of("Pick", after_shortcuts(trained, lame, PUTTING)).failed
    assert {record.objects for record in failed} == {("thing1",)}
    points = get_domain("points", "long_line")
    initial = points.task(0, 1).initial_state
    began = State(initial.layout, np.array(failed[0].state))
    space = points.atom_space(initial)
    at_place = space.mask(parse_goal("(At thing0 place0)", space))
    assert space.abstract(began) & at_place and not space.abstract(initial) & at_place


def test_without_skills_none_is_tried_after_shortcuts(trained):
    """What plans need at all is learned first."""
    assert after_shortcuts(trained) == []


def test_skills_to_keep_are_tried_after_shortcuts(trained, tmp_path, in_this_process):
    skills, library = trained.folder / "steady", trained.folder / "library"
    asked = [
        "acquire", "points", "--preset", "long_line", "--shortcuts", library, "--goal", THEN_PICK,
        "--set", "rollouts=2", "--set", "validation=2", "--jobs", 1, "--json",
    ]  # fmt: skip
    answer = slap(*asked, "--keep", skills, "--output", tmp_path / "made")
    assert answer.exit_code == 0, answer.output
    record = json.loads(answer.stdout)
    assert (record["ended"], record["shortcuts"]) == ("nothing fails", "library")
    assert " --keep steady --shortcuts library" in record["command"]
    plans = json.loads((tmp_path / "made-training/iteration0/rollouts.json").read_text())
    assert len(plans) > 2 and {len(plan["plan"]) for plan in plans[2:]} == {1}
    refused = slap(*asked, "--output", tmp_path / "other")
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    assert "--shortcuts is for --keep" in " ".join(refused.stderr.split())
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    refused = slap(*asked, "--keep", slower, "--output", tmp_path / "other")
    assert refused.exit_code == ErrorCode.SKILLS_CHANGED
    assert not (tmp_path / "other").exists()


class Interrupted(Unwatched):
    """Ctrl-C when a shortcut was learned, before anything is known of it."""

    def on_validated(self, name, before, after, kept):
        raise KeyboardInterrupt


def test_what_grows_is_what_the_other_commands_make_interrupted_or_not(trained, tmp_path):
    """Skills that work are kept; so the second round finds nothing to learn, and is the last."""
    folder = tmp_path / "grown"
    request = GrowthRequest(
        get_domain("points", "line"), folder, keep=trained.folder / "steady",
        skill_changes=["rollouts=2", "validation=2"],
        shortcut_settings="ours", shortcut_changes=SMALL, steps=100_000,
    )  # fmt: skip
    with pytest.raises(KeyboardInterrupt):
        grow_rounds(request, watch=GrowthWatch(shortcuts=lambda: nullcontext(Interrupted())))
    assert not (folder / "report.md").exists() and not (folder / "shortcuts").exists()
    grown = grow_rounds(request)
    assert grown.ended == "no skill learns from where shortcuts have led"
    assert len(grown.rounds) == 2 and grown.best == 0
    (tried,) = grown.rounds[0].tried
    made = json.loads(trained.answer.stdout)["validation"]
    assert (tried.before, tried.after) == (made["pure_planning"], made["slap"])
    policy = f"{tried.name}/policy.safetensors"
    grown_there, made_there = folder / "shortcuts" / policy, trained.folder / "library" / policy
    assert grown_there.read_bytes() == made_there.read_bytes()
    page = (folder / "report.md").read_text()
    assert tried.name in page and str(tmp_path) not in page and "It ended since" in page
    taken = load_library(folder / "shortcuts", request.domain).record["environment_steps"]
    assert grown.rounds[0].shortcut_steps == taken["exploring"] + taken["learning"]
    assert sum(one.steps for one in grown.rounds) <= request.steps
    before = contents(folder)
    assert grow_rounds(request) == grown and contents(folder) == before
    told = events_of_growth(folder, request)
    assert contents(folder) == before
    assert [one["event"] for one in told] == ["round", "round", "grown"]
    assert told[0]["shortcuts"] == [tried.name] and told[0]["length"] == tried.after
    assert Path(told[-1]["shortcut_library"]) == folder / "shortcuts"
    assert told[-1]["steps"] == told[0]["steps"] + told[1]["steps"] and told[-1]["best"] == 1
    with pytest.raises(InvalidParameterError, match="has a training with other settings"):
        grow_rounds(replace(request, seed=1))


def events_of_growth(folder, request):
    """What `slap grow` says to another process."""
    answer = slap(
        "grow", "points", "--preset", "line", "--output", folder, "--keep", request.keep,
        "--set-skills", "rollouts=2", "--set-skills", "validation=2", "--settings", "ours",
        *CHANGES, "--steps", request.steps, "--jobs", 1, "--events",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    return list(map(json.loads, answer.stdout.splitlines()))


class EndedAfterRoundError(Exception):
    """Whatever ends a command after a round."""


def no_round_after(number, _):
    raise EndedAfterRoundError(number)


NOTHING_TO_DO = "(and (HandEmpty ))"  # no skill is tried, so none fails and none is learned


def test_a_later_round_without_a_plan_leaves_the_best_so_far(trained, tmp_path):
    """Its skills are gone wrong: with them no plan reaches the goal in the model."""
    folder = tmp_path / "grown"
    request = GrowthRequest(
        get_domain("points", "line"), folder, keep=trained.folder / "steady", goal=NOTHING_TO_DO,
        skill_changes=["rollouts=2", "validation=2"],
        shortcut_settings="ours", shortcut_changes=SMALL, steps=100_000,
    )  # fmt: skip
    with pytest.raises(EndedAfterRoundError):
        grow_rounds(request, watch=GrowthWatch(on_round=no_round_after))
    assert "It goes on with the same command." in (folder / "report.md").read_text()
    best = [contents(folder / name) for name in ("skills", "shortcuts")]
    assert best == [contents(folder / "round1" / name) for name in ("skills", "shortcuts")]
    spoil(folder / "round1")
    seen = []
    grown = grow_rounds(request, watch=GrowthWatch(on_round=lambda number, _: seen.append(number)))
    assert seen == [0] and len(grown.rounds) == 1 and grown.best == 0
    assert grown.ended.startswith("round 2 led to nothing: none of 3 tasks for validation has")
    assert grown.ended in (folder / "report.md").read_text()
    assert contents(folder / "shortcuts") == contents(folder / "round1/shortcuts")
    with pytest.raises(UnsolvableError):  # where there is nothing to keep
        grow_rounds(replace(request, folder=tmp_path / "first", keep=folder / "round1/skills"))
    assert not (tmp_path / "first/report.md").exists()


def spoil(first_round):
    """Skills of a round are replaced by others, which the next round keeps."""
    digest = json.loads((first_round.with_suffix(".json")).read_text())["skills_digest"]
    shutil.rmtree(first_round / "skills")
    write_library(first_round / "skills", PICKING, replace(PUTTING, horizon=1))
    points = open_domain(DomainChoice("points", "line", str(first_round / "skills")))
    record = first_round / "shortcuts/library.json"
    record.write_text(record.read_text().replace(digest, points.configuration["skills_digest"]))


def test_a_budget_is_that_of_exploring_and_of_all_shortcuts_together(trained, tmp_path):
    """Exploring leaves too little for a shortcut: none is begun, however promising it is."""
    skills = trained.folder / "steady"
    explored = json.loads(trained.answer.stdout)["environment_steps"]["exploring"]
    budget = explored + 6144 - 1
    work = shutil.copytree(trained.folder / "library-training", tmp_path / "work")
    (work / "settings.json").unlink()  # what was explored is the same
    answer = train(skills, tmp_path / "library", "--work", work, "--set", f"budget={budget}")
    assert answer.exit_code == 0, answer.output
    record = json.loads(answer.stdout)
    assert record["environment_steps"] == {"exploring": explored, "learning": 0, "spent": explored}
    assert record["validation"]["slap"] == record["validation"]["pure_planning"]
    (work / "settings.json").unlink()
    answer = train(skills, tmp_path / "paid", "--work", work, "--set", f"budget={budget + 1}")
    taken = json.loads(answer.stdout)["environment_steps"]
    assert taken["spent"] == taken["exploring"] + taken["learning"] <= budget + 1
    assert "spent" not in json.loads(trained.answer.stdout)["environment_steps"]


def grown_round(digest, unsolved, length, kept=True):
    """A round as `slap grow` keeps it."""
    tried = TriedShortcut("At-1", length + 9.0, length, kept)
    return GrowthRound(
        ("Pick",), digest, 1.0, "nothing fails", length + 9.0, length, (tried,), 100, 100, unsolved
    )


def test_a_round_that_solves_more_tasks_is_better_though_its_plans_are_longer():
    """Tasks that had no plan before are the longer ones: their mean says nothing against it."""
    request = GrowthRequest(
        get_domain("points", "line"), Path("grown"), shortcut_settings="ours",
        shortcut_changes=SMALL, steps=100_000,
    )  # fmt: skip
    weak, able = grown_round("1", 3, 40.0), grown_round("2", 0, 50.0)
    assert request.why_over([weak, able]) == ""
    assert request.why_over([able, replace(weak, skills_digest="3")]) == "plans get no shorter"
    spent = replace(able, skill_steps=90_000, tried=())  # no shortcut could be paid
    assert request.why_over([spent]) == "the budget is spent"
    shorter = grown_round("3", 0, 45.0, kept=False)
    assert request.why_over([able, shorter]) == "no shortcut makes plans shorter"
    assert min((weak, able, shorter), key=lambda one: one.rank) is shorter
    assert GrowthRound.from_json(weak.as_json()) == weak
    page = growth_page(request, (weak, able), 1, "the budget is spent")
    assert "The best is round 2" in page and "Validation tasks without a plan: 3." in page


def test_tasks_without_a_plan_are_counted_where_they_are_for_validation():
    notes = TrainingNotes(Unwatched())
    for use in (jobs.VALIDATION.use, jobs.EXPLORATION.use, jobs.VALIDATION.use):
        notes.on_left_out(use, 0, "no path")
    assert notes.unsolved == 2


def test_a_budget_below_a_round_is_refused_with_what_a_round_takes(tmp_path):
    asked = ["grow", "points", "--preset", "line", "--output", tmp_path / "grown", *CHANGES]
    answer = slap(*asked, "--settings", "ours", "--steps", 6000)
    assert answer.exit_code == ErrorCode.INVALID_PARAMETER
    said = " ".join(answer.stderr.split())
    assert "too few for a round" in said and "of exploration usually take 7680, and a" in said
    assert "a shortcut takes 6144; give --steps" in said
    assert not (tmp_path / "grown").exists()


@pytest.mark.slow
def test_an_evaluation_against_skills_names_them_and_both_digests(trained, tmp_path):
    skills, library = trained.folder / "steady", trained.folder / "library"
    given = ["--preset", "line", "--skills", skills, "--tasks", 2, "--seeds", 1]
    against = [*given, "--shortcuts", library, "--against", "skills"]
    answer = slap("evaluate", "points", *against, "--json", "--output", tmp_path / "all.json")
    assert answer.exit_code == 0, answer.output
    rows = json.loads(answer.stdout)["approaches"]
    assert [row["approach"] for row in rows] == ["skills", "slap_1_sample", "slap"]
    assert rows[0]["relative_length"] == 1.0 > rows[2]["relative_length"]
    made_of = json.loads((tmp_path / "all.json").read_text())
    assert made_of["skills"]["digest"] in answer.stderr
    assert made_of["library"]["digest"] in answer.stderr
    assert " --against skills " in made_of["command"]
    refused = slap("evaluate", "points", *given, "--against", "skills")
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    assert "give --skills and --shortcuts" in " ".join(refused.stderr.split())


def test_the_same_training_goes_on_with_the_same_skills_alone(trained, tmp_path):
    """Wherever their folder is; others make another training."""
    elsewhere = shutil.copytree(trained.folder / "steady", tmp_path / "elsewhere")
    again = train(elsewhere, tmp_path / "again", "--work", trained.folder / "library-training")
    made, first = json.loads(again.stdout), json.loads(trained.answer.stdout)
    assert made["validation"] == first["validation"]
    slower = write_library(tmp_path / "slower", PICKING, replace(PUTTING, horizon=20))
    refused = train(slower, tmp_path / "other", "--work", trained.folder / "library-training")
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    assert "has a training with other settings" in " ".join(refused.stderr.split())


def test_skills_that_lack_an_operator_leave_nothing_to_shorten(tmp_path):
    half = write_library(tmp_path / "half", PICKING)
    answer = train(half, tmp_path / "library")
    assert answer.exit_code == ErrorCode.UNSOLVABLE
    assert "lacks a skill for Put(" in " ".join(answer.stderr.split())


@pytest.fixture
def hasty(tmp_path):
    """Tasks whose plans fail in the model: Put is over before it is there."""
    skills = write_library(tmp_path / "hasty", PICKING, replace(PUTTING, horizon=1))
    choice = DomainChoice("points", "line", str(skills))
    return TaskDistribution(DomainChoice.of(open_domain(choice), str(skills)), 0)


def test_a_plan_that_fails_in_the_model_is_no_plan_to_shorten(hasty):
    """Its steps end where it fails: counted as a length, a plan that works would be longer."""
    domain = hasty.make_domain()
    task = domain.task(hasty.task_seed, jobs.VALIDATION.index(0))
    problem = Problem.of(domain, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    assert GraphPlanner(problem).plan(task.initial_state, goal).fails  # so it would be executed
    assert "Put" in str(jobs.plan_length(hasty, 0, (), DEFAULT))
    assert jobs.mean_length([jobs.plan_length(hasty, 0, (), DEFAULT)]) == math.inf
    explored = jobs.try_to_explore(hasty, 0, training_settings("ours", domain).exploration)
    assert "Put" in str(explored) and isinstance(explored, str)
    alone = PlanningSetup(hasty.domain, "lazy", PURE_PLANNING)
    planned = plan_once(alone, hasty.task_seed, jobs.VALIDATION.index(0))
    assert not planned.success and "Put" in planned.reason


@pytest.mark.parametrize("name", ["join", "grown", "grown/seed1", "grown/seed2"])
def test_libraries_that_ship_together_are_those_that_were_evaluated(name):
    folder = Path(__file__).parents[2] / "models" / name
    bench = open_domain(DomainChoice("stack_at_target", "fair:blocked=1", str(folder / "skills")))
    evaluated = json.loads((folder / "evaluation.json").read_text())
    assert evaluated["skills"]["digest"] == bench.configuration["skills_digest"]
    library = chosen_library(str(folder / "shortcuts"), bench)  # refused over other skills
    assert evaluated["library"]["digest"] == library.digest


@pytest.mark.parametrize(
    ("found", "name"),
    [("chains", "peg_in_hole"), ("chains", "stow_hammer"), ("approaches", "make_coffee")],
)
def test_a_library_over_skills_that_ship_is_the_one_that_was_evaluated(found, name):
    models = Path(__file__).parents[2] / "models"
    bench = open_domain(DomainChoice(name, "fair", str(models / "skills" / name)))
    evaluated = json.loads((models / found / name / "evaluation.json").read_text())
    assert evaluated["skills"]["digest"] == bench.configuration["skills_digest"]
    library = chosen_library(str(models / found / name / "shortcuts"), bench)
    assert evaluated["library"]["digest"] == library.digest


@pytest.mark.parametrize(
    ("found", "name", "seed"), [("chains", "stow_hammer", 300), ("approaches", "make_coffee", 302)]
)
def test_what_is_cloned_shortens_a_plan_that_a_fresh_world_confirms(found, name, seed):
    models = Path(__file__).parents[2] / "models"
    bench = open_domain(DomainChoice(name, "fair", str(models / "skills" / name)))
    library = chosen_library(str(models / found / name / "shortcuts"), bench)
    alone, one_sample, _ = approaches(library, DEFAULT)
    before, after = (solve(bench, bench.task(seed), each, "lazy") for each in (alone, one_sample))
    assert before.success and after.success
    assert after.plan_length < 0.9 * before.plan_length


@pytest.mark.slow
@pytest.mark.timeout(300)  # plans in contact, with the paper's search as well
def test_the_join_that_ships_belongs_together_and_saves_steps():
    """Both searches agree to the step; where all shortcuts fail, the plan is that of the skills."""
    join = Path(__file__).parents[2] / "models" / "join"
    bench = open_domain(DomainChoice("stack_at_target", "fair:blocked=1", str(join / "skills")))
    library, task = chosen_library(str(join / "shortcuts"), bench), bench.task(1)
    alone, one_sample, _ = approaches(library, DEFAULT)
    _, lame, _ = approaches(failing(library), DEFAULT)
    made = {
        planner: [solve(bench, task, each, planner) for each in (alone, one_sample)]
        for planner in ("lazy", "exhaustive")
    }
    assert all(episode.success for episodes in made.values() for episode in episodes)
    lengths, exhaustive = ([one.plan_length for one in each] for each in made.values())
    assert lengths == exhaustive
    assert lengths[1] < 0.9 * lengths[0]
    without = solve(bench, task, lame, "lazy")
    assert np.array_equal(without.actions, made["lazy"][0].actions)
