# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts that are learned over acquired skills: both halves in one plan."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from ensemble.observation import Episode
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from slap_ros.api.shortcut_choice import choose_library
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, SkillsChangedError
from slap_ros.evaluation.approaches import approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import chosen_library, require_usable
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from support.steady_skills import PICKING, PUTTING, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
SMALL = [
    "polish=none", "ppo.total_steps=6144", "starts=24", "validation=3", "shortcuts=1",
    "exploration.tasks=3", "exploration.nodes=1", "exploration.rollouts=128",
    "exploration.action_repeat=3", "exploration.length=20",
]  # fmt: skip
CHANGES = [word for change in SMALL for word in ("--set", change)]


def slap(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


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


@pytest.mark.slow
@pytest.mark.timeout(180)  # plans in contact
def test_the_join_that_ships_belongs_together_and_saves_steps():
    join = Path(__file__).parents[2] / "models" / "join"
    bench = open_domain(DomainChoice("stack_at_target", "fair:blocked=1", str(join / "skills")))
    library = chosen_library(str(join / "shortcuts"), bench)
    alone, one_sample, _ = approaches(library, DEFAULT)
    solved = [solve(bench, bench.task(1), approach) for approach in (alone, one_sample)]
    assert all(episode.success for episode in solved)
    assert solved[1].plan_length < 0.9 * solved[0].plan_length
