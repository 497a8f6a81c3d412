# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of pruned candidates: which are, where they begin, and that learning them is real."""

import json
from dataclasses import replace

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.candidate_groups import problem_key
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.slap.drawn_candidates import (
    LearningProblem,
    TaskCandidates,
    candidates_of_task,
    learn_candidate,
    problems_of,
    starts_in_task,
)
from support.slap_command import slap

pytest.importorskip("matplotlib")
TRAINING = TaskDistribution(DomainChoice("obstacle2d", "fair"), 0)
SETTINGS = training_settings("ours", get_domain("obstacle2d"))


@pytest.fixture(scope="module")
def explored():
    return TaskCandidates.from_json(candidates_of_task(TRAINING, 0, SETTINGS, 1000))


def key_of(one):
    return problem_key(one.signature)


def test_every_pair_is_drawn_once_and_what_training_would_learn_is_not_called_pruned(explored):
    assert len(explored.drawn) == explored.explored.pairs > 50
    problems = problems_of([explored], explored.explored.pairs)
    assert sum(one.pairs for one in problems) == explored.explored.pairs
    pruned = {key_of(one.candidate) for one in problems if one.pruned}
    found = {key_of(one) for one in explored.explored.candidates}
    joined = {key_of(one.candidate) for one in problems if not one.pruned}
    assert pruned and found and found <= joined and not pruned & joined


def test_of_each_task_as_many_are_drawn_as_is_its_share(explored):
    small = TaskCandidates.from_json(candidates_of_task(TRAINING, 1, SETTINGS, 1000))
    pairs = explored.explored.pairs, small.explored.pairs
    drawn = problems_of([explored, small], 20)
    assert sum(one.pairs for one in drawn) == sum(round(20 * n / sum(pairs)) for n in pairs)
    assert drawn == problems_of([explored, small], 20)


def starts_of(problems, steps, tasks):
    """For each of the problems, its starts in the tasks, as records."""
    candidates = [one.candidate for one in problems]
    found = [starts_in_task(TRAINING, i, candidates, steps) for i in tasks]
    return [[StartRecord.from_json(one) for one in own if one] for own in zip(*found, strict=True)]


def test_a_candidate_begins_where_its_operators_lead(explored):
    steps = explored.explored.operator_steps
    problems = problems_of([explored], 10)
    assert all(starts_of(problems, steps, range(3)))


def test_a_candidate_begins_among_others_where_it_begins_alone(explored):
    steps = explored.explored.operator_steps
    candidates = [one.candidate for one in problems_of([explored], 10)]
    alone = [jobs.start(TRAINING, 2, one.signature, one.operator_path, steps) for one in candidates]
    assert any(alone) and len({str(one) for one in alone}) > 1
    assert starts_in_task(TRAINING, 2, candidates, steps) == alone


@pytest.mark.slow
def test_what_rollouts_join_can_be_learned_and_shortens_plans(explored):
    best = max(explored.explored.candidates, key=lambda one: one.hits)
    (problem,) = [
        one
        for one in problems_of([explored], explored.explored.pairs)
        if key_of(one.candidate) == key_of(best)
    ]
    assert isinstance(problem, LearningProblem) and not problem.pruned
    settings = replace(SETTINGS, starts=50).with_total_steps(30_000)
    plain = {i: jobs.plan_length(TRAINING, i, (), settings.sampling) for i in range(6)}
    (starts,) = starts_of([problem], explored.explored.operator_steps, range(50))
    learned = learn_candidate(TRAINING, problem.candidate.signature, tuple(starts), settings, plain)
    assert learned.success > 0.5 and learned.relative < 1.0


@pytest.mark.slow
def test_the_page_counts_what_its_data_has(tmp_path):
    sizes = ["--candidates", 4, "--tasks", 1, "--starts", 2, "--steps", 4096]
    ran = slap("study", "pruned", "obstacle2d", *sizes, "--output", tmp_path)
    assert ran.exit_code == 0, ran.output
    data = json.loads((tmp_path / "pruned_obstacle2d.json").read_text())
    assert data["steps"] == 4096 and data["starts"] == 2
    rows, classes = data["found"]["candidates"], data["found"]["classes"]
    for name, pruned in (("pruned", True), ("joined by rollouts", False)):
        own = [row for row in rows if row["pruned"] is pruned]
        assert classes[name]["pairs"] == sum(row["pairs"] for row in own)
    assert sum(row["pairs"] for row in rows) == 4
    assert "| pruned | " in (tmp_path / "pruned_obstacle2d.md").read_text()


def test_settings_that_there_are_not_are_refused(tmp_path):
    ran = slap("study", "pruned", "obstacle2d", "--settings", "hers", "--output", tmp_path)
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER and "hers" in ran.stderr
    assert not list(tmp_path.iterdir())
