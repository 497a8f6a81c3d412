# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning and executing from Python: the same as from the command line."""

import json
import re
import subprocess
import sys

import pytest

import slap_ros
from slap_ros.core import Domain, Task
from slap_ros.errors import (
    InvalidLibraryError,
    InvalidParameterError,
    NoSkillsError,
    UnknownDomainError,
)
from slap_ros.planning.options import OptionKind
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library


def slap(*arguments, code=0):
    """What a ``slap`` command prints as JSON."""
    told = subprocess.run(
        [sys.executable, "-m", "ensemble.cli", *map(str, arguments), "--json"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert told.returncode == code, told.stderr
    return json.loads(told.stdout)


def test_the_example_of_the_package_runs_as_it_stands(capsys):
    example = re.search(r"::\n\n((?:    .*\n|\n)+)", slap_ros.__doc__)[1]
    names = {}
    exec("\n".join(line[4:] for line in example.splitlines()), names)
    plan, run = names["plan"], names["run"]
    printed = capsys.readouterr().out
    assert run.success
    pure = slap_ros.plan(names["domain"], names["task"], shortcuts=None)
    assert printed == f"{plan} {run.steps} {pure.steps}\n"
    assert run.steps == plan.steps < pure.steps
    assert names["domain"].preset == "fair:obstacles=4"


def test_what_is_returned_are_the_cores_own_objects(domain, task, plan, run):
    assert isinstance(domain, Domain)
    assert isinstance(task, Task)
    assert (task.seed, task.index) == (1, 0)
    assert isinstance(plan, PlanningResult)
    assert run.states[0] == task.initial_state
    assert len(run.states) == run.steps + 1 == len(run.actions) + 1


def test_a_plan_is_printed_as_a_line_per_edge_and_the_sum(plan):
    *edges, last = str(plan).splitlines()
    assert len(edges) == len(plan.plan.edges)
    assert last.split() == [str(plan.steps), "steps"]
    assert sum(int(line.split()[0]) for line in edges) == plan.steps
    learned = [edge.option.kind is OptionKind.SHORTCUT for edge in plan.plan.edges]
    assert [line.endswith("(shortcut)") for line in edges] == learned
    assert any(learned)


def test_the_command_line_makes_the_same_plan(domain, task, plan):
    found = slap("plan", "obstacle2d", "--seed", 1)
    edges = [{"option": str(e), "predicted_steps": e.predicted_steps} for e in plan.plan.edges]
    assert found["plan"] == edges
    assert found["predicted_steps"] == plan.steps
    assert found["edges_rolled_out"] == plan.edges_rolled_out
    assert found["bound"] == plan.bound
    pure = slap_ros.plan(domain, task, shortcuts=None)
    assert slap("plan", "obstacle2d", "--seed", 1, "--shortcuts", "none")["plan"] == [
        {"option": str(e), "predicted_steps": e.predicted_steps} for e in pure.plan.edges
    ]


@pytest.mark.slow
def test_shortcuts_are_those_that_ship_or_a_folders_or_a_library(domain, task, plan):
    folder = shipped_library("obstacle2d")
    library = load_library(folder, domain)
    for shortcuts in (folder, str(folder), library):
        again = slap_ros.plan(domain, task, shortcuts)
        assert [str(e) for e in again.plan.edges] == [str(e) for e in plan.plan.edges]
        assert again.origin == plan.origin
    assert plan.origin.library == library.digest


def test_settings_are_those_of_the_preset():
    tower = slap_ros.make("obstacle_tower", obstacles=4, mass=(0.8, 1.2))
    assert tower.preset == "fair:obstacles=4,mass=0.8..1.2"
    further = slap_ros.make("obstacle_tower", "fair:obstacles=4", mass=(0.8, 1.2))
    assert further.configuration == tower.configuration


def test_what_cannot_be_is_refused(domain, task, plan):
    with pytest.raises(UnknownDomainError):
        slap_ros.make("nowhere")
    with pytest.raises(InvalidParameterError, match="unknown setting"):
        slap_ros.make("obstacle_tower", blocks=4)
    with pytest.raises(InvalidParameterError, match="at least 1"):
        slap_ros.plan(domain, task, samples=0)
    with pytest.raises(NoSkillsError):
        slap_ros.plan(slap_ros.make("obstacle2d", skills=None), task)
    library = load_library(shipped_library("obstacle2d"), domain)
    tower = slap_ros.make("obstacle_tower")
    with pytest.raises(InvalidLibraryError):
        slap_ros.plan(tower, tower.task(seed=1), library)
    with pytest.raises(InvalidParameterError, match="without shortcuts"):
        slap_ros.plan(domain, task, library, planner="ff")
    with pytest.raises(InvalidParameterError):
        slap_ros.execute(domain, task, plan, max_replans=-1)


def test_a_run_solves_the_task_in_as_many_steps_as_were_planned(plan, run):
    assert run.success
    assert run.steps == plan.steps
    assert not run.error
    assert str(run).endswith(f"{run.steps:5d}  steps, solved")


def test_without_a_plan_it_is_planned_with_what_ships(domain, task, run):
    again = slap_ros.execute(domain, task)
    assert again.success
    assert again.states == run.states


def test_a_plan_that_leads_nowhere_is_replaced(domain, task, plan):
    """The last edge alone cannot be executed from the start."""
    wrong = Plan(plan.plan.edges[-1:])
    run = slap_ros.execute(domain, task, wrong)
    assert run.success
    assert run.episode.replans == 1
    assert not run.edges[0].reached
    without = slap_ros.execute(domain, task, wrong, max_replans=0)
    assert not without.success
    assert "diverged" in without.error


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda domain, _: slap_ros.evaluate(domain, jobs=0), "jobs must be at least 1, not 0"),
        (lambda domain, _: slap_ros.evaluate(domain, tasks=0), "tasks must be at least 1"),
        (lambda domain, _: slap_ros.evaluate(domain, seeds=1.5), "a whole number, not 1.5"),
        (lambda domain, _: slap_ros.evaluate(domain, first_seed=-1), "first_seed must be at"),
        (lambda domain, _: domain.task(seed="1"), "seed must be a whole number, not '1'"),
        (lambda domain, _: slap_ros.plan(domain, domain.task(1), samples=1.5), "number, not 1.5"),
        (lambda domain, _: domain.task(seed=1, index=-1), "index must be at least 0, not -1"),
        (lambda domain, folder: slap_ros.train(domain, folder, seed=-1), "seed must be at least"),
    ],
)
def test_numbers_that_cannot_be_are_refused_before_anything_is_done(domain, tmp_path, call, words):
    with pytest.raises(InvalidParameterError, match=words):
        call(domain, tmp_path / "library")
    assert not list(tmp_path.iterdir())


WRONG_KINDS = {
    'slap_ros.evaluate("obstacle2d")': "domain must be a Domain such as slap_ros.make(",
    "slap_ros.plan(task, domain)": "domain must be a Domain such as",
    "slap_ros.plan(domain, 1)": "task must be a Task such as domain.task(seed=1), not 1",
    "slap_ros.plan(domain, task, planner=None)": "planner must be a text, not None",
    "slap_ros.execute(domain, plan)": "such as domain.task(seed=1), not a PlanningResult",
    "slap_ros.execute(domain, task, [plan])": "slap_ros.plan(domain, task), a Plan or None,",
    "slap_ros.train(domain, None)": "folder must be a path or a text, not None",
    'slap_ros.train(domain, folder, changes="a=1")': "a mapping or a list (each a text), not 'a=1'",
    "slap_ros.train(domain, folder, callback=print)": "callback must be a TrainingCallback or None",
    "slap_ros.train(domain, folder, steps=-1)": "steps must be at least 1, not -1",
    "slap_ros.acquire(domain, folder, begin_with=[3])": "a path or a text), not a list",
    "slap_ros.acquire(domain, folder, watch=3)": "watch must be an AcquisitionWatch, not 3",
    "slap_ros.load_bag(3)": "path must be a path or a text, not 3",
    "slap_ros.make(domain)": "name must be a text, not a Domain",
    'slap_ros.propose("obstacle2d", task)': "not 'obstacle2d'",
}


@pytest.mark.parametrize("call", WRONG_KINDS)
def test_arguments_of_wrong_kinds_are_refused(domain, task, plan, tmp_path, call):
    given = {"domain": domain, "task": task, "plan": plan, "folder": tmp_path / "library"}
    with pytest.raises(InvalidParameterError, match=re.escape(WRONG_KINDS[call])):
        eval(call, {"slap_ros": slap_ros} | given)
    assert not list(tmp_path.iterdir())


def test_an_argument_that_is_missing_is_pythons_own_error(domain):
    with pytest.raises(TypeError, match=r"plan\(\) missing 1 required positional argument: 'task'"):
        slap_ros.plan(domain)


def test_a_folder_to_begin_with_may_be_given_alone(tmp_path):
    bench = slap_ros.make("stack_at_target")
    with pytest.raises(InvalidLibraryError, match="no/library: no such folder"):
        slap_ros.acquire(bench, tmp_path / "skills", begin_with="no/library")
