# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Evaluating, proposing and learning from Python: the same as from the command line."""

import json
from contextlib import nullcontext

import pytest

import slap_ros
from slap_ros.api import training
from slap_ros.api.proposers import Proposers
from slap_ros.api.setting_texts import change_texts
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.setting_changes import parse_changes
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DEMONSTRATOR
from support.slap_command import slap

TOY = {
    "exploration.tasks": 2,
    "exploration.rollouts": 60,
    "exploration.length": 30,
    "exploration.action_repeat": 4,
    "polish": None,
    "starts": 24,
    "validation": 3,
    "shortcuts": 1,
}
STEPS = 6_000


def printed(*arguments):
    """What a ``slap`` command prints, in this process."""
    ran = slap(*arguments)
    assert ran.exit_code == 0, ran.stderr
    return ran.stdout


@pytest.mark.slow
def test_trials_are_those_of_the_command(domain, tmp_path):
    rows = slap_ros.evaluate(domain, tasks=1, seeds=1)
    file = tmp_path / "trials.json"
    printed("evaluate", "obstacle2d", "--tasks", 1, "--seeds", 1, "--output", file)
    stored = [
        {"approach": one["approach"], **trial}
        for one in json.loads(file.read_text(encoding="utf-8"))["approaches"]
        for trial in one["trials"]
    ]
    assert [row.approach for row in rows] == ["pure_planning", "slap_1_sample", "slap"]
    same = ("approach", "seed", "index", "success", "plan_length", "shortcut_steps", "replans")
    for row, trial in zip(rows, stored, strict=True):
        assert {name: getattr(row, name) for name in same} == {n: trial[n] for n in same}
        assert row.edges_rolled_out == trial["edges_rolled_out"]
        assert row.bound == trial["bound"] == 1.0
        assert row.error == "NONE"


def test_a_domain_is_evaluated_with_the_skills_that_it_was_made_with():
    """Tasks are solved in a domain that is made anew, of which the one at hand tells enough."""
    bench = slap_ros.make("peg_in_hole", skills=DEMONSTRATOR)
    (row,) = slap_ros.evaluate(bench, tasks=1, seeds=1)
    run = slap_ros.execute(bench, bench.task(seed=0))
    assert (row.success, row.plan_length) == (run.success, run.steps)
    assert run.success


def test_a_proposal_is_that_of_the_command():
    bench = slap_ros.make("stow_hammer")
    proposal = slap_ros.propose(bench, bench.task(seed=1), rewarder="composed")
    told = printed("propose", "stow_hammer", "--seed", 1, "--rewarder", "composed", "--json")
    assert json.loads(json.dumps(proposal.to_data())) == json.loads(told)["proposal"]


@pytest.mark.parametrize(
    "command",
    [
        ("train", "obstacle2d"),
        ("acquire", "stack_at_target"),
        ("acquire-sequence", "bowls"),
        ("baseline", "train", "ppo", "obstacle2d"),
    ],
)
def test_nothing_but_a_library_is_replaced_by_one(command, tmp_path):
    """Neither a file, nor a folder with somebody's files; it is seen before anything is learned."""
    mine = tmp_path / "thesis" / "thesis.tex"
    mine.parent.mkdir()
    mine.write_text("years of work", encoding="utf-8")
    for place in (mine, mine.parent):
        ran = slap(*command, "--output", place)
        assert ran.exit_code == InvalidParameterError.code
        assert "is no library" in " ".join(ran.stderr.split())
    assert mine.read_text(encoding="utf-8") == "years of work"


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        (("train", "obstacle2d"), "skills"),
        (("acquire", "stack_at_target"), "shortcuts"),
        (("acquire-sequence", "bowls"), "shortcuts"),
        (("baseline", "train", "ppo", "obstacle2d"), ""),
    ],
)
def test_a_library_replaces_none_of_another_kind_and_no_checkpoints(command, kind, tmp_path):
    member = tmp_path / "library" / "one" / f"{kind[:-1] or 'skill'}.json"
    member.parent.mkdir(parents=True)
    for path in (member, tmp_path / "library" / "library.json"):
        path.write_text("{}", encoding="utf-8")
    ran = slap(*command, "--output", tmp_path / "library")
    assert ran.exit_code == InvalidParameterError.code
    assert (f"a library of {kind}" if kind else "is no library") in " ".join(ran.stderr.split())
    assert member.read_text() == "{}"
    new = tmp_path / "new"
    for work in (new, new / "work"):
        ran = slap(*command, "--output", new, "--work", work)
        assert ran.exit_code == InvalidParameterError.code
        assert "would be lost when the library" in " ".join(ran.stderr.split())
    assert not new.exists()


def test_proposers_that_do_not_fit_are_refused():
    bench = slap_ros.make("stow_hammer")
    with pytest.raises(InvalidParameterError, match="oracle"):
        slap_ros.propose(bench, bench.task(seed=1), "oracle")
    with pytest.raises(InvalidParameterError, match="--model"):
        slap_ros.propose(bench, bench.task(seed=1), Proposers(model="small"))


def test_changes_of_settings_are_texts_and_back():
    changes = {**TOY, "polish": None, "ppo.net_arch": (8, 8), "ppo.anneal": False}
    assert parse_changes(change_texts(changes), TrainingSettings) == changes


@pytest.mark.training
@pytest.mark.slow
def test_a_library_is_that_of_the_command(domain, tmp_path, monkeypatch):
    """Of a toy training, in this process from both; torch is imported once."""
    monkeypatch.setattr(training, "some_workers", lambda *_: nullcontext(SequentialWorkers()))
    library = slap_ros.train(domain, tmp_path / "api", seed=5, changes=TOY, steps=STEPS)
    words = [word for text in change_texts(TOY) for word in ("--set", text)]
    printed(
        "train", "obstacle2d", "--seed", 5, "--steps", STEPS, *words,
        "--output", tmp_path / "command", "--jobs", 1,
    )  # fmt: skip
    other = load_library(tmp_path / "command", domain)
    assert library.record["command"] == other.record["command"]
    assert library.record["command"].startswith("slap train obstacle2d --preset fair --seed 5")
    assert library.digest == other.digest == load_library(tmp_path / "api", domain).digest
    assert len(library.shortcuts) == 1
    slap_ros.plan(domain, domain.task(seed=1), library)


def test_approaches_are_refused_where_a_domain_has_none(domain, tmp_path):
    for wanted in ({"settings": "ours_approaches"}, {"changes": {"exploration.approaches": 1}}):
        with pytest.raises(InvalidParameterError, match="from which sides"):
            slap_ros.train(domain, tmp_path / "library", **wanted)
    assert not list(tmp_path.iterdir())


def test_a_domain_without_skills_to_acquire_is_refused(domain, tmp_path):
    with pytest.raises(InvalidParameterError, match="what skills are acquired with"):
        slap_ros.acquire(domain, tmp_path / "skills")
    assert not (tmp_path / "skills").exists()
