# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clones of skills: what they learn from, whether they do the same, and the study of them."""

import json

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import ErrorCode, InvalidParameterError, UnsolvableError
from slap_ros.imitation.cloning import clone_policy, clone_skills
from slap_ros.imitation.settings import CloningSettings
from slap_ros.imitation.trajectories import record_trajectories
from slap_ros.skills.acquired_domain import acquired_domain
from slap_ros.skills.demonstrator import DEMONSTRATION_SEED
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary
from support.points import HORIZON, POINTS, PUT, REWARDS
from support.steady_skills import PICKING, PUTTING, towards, write_library

SHORT = CloningSettings(updates=500, learning_rate=5e-3)
# Lets go at once: by chance where the object is to be, and nowhere else.
DROPPING = AcquiredSkill(PUT, REWARDS["Put"], towards(1, True, gain=0.0), HORIZON)


def with_skills(*skills):
    return acquired_domain(POINTS, SkillLibrary(POINTS.name, skills))


@pytest.fixture(scope="module")
def steady():
    return with_skills(PICKING, PUTTING)


@pytest.fixture(scope="module")
def trajectories(steady):
    return record_trajectories(steady, "", steady.skills, 12)


@pytest.fixture(scope="module")
def clones(steady, trajectories):
    return clone_skills(steady.skills, trajectories, SHORT, 0)


# -- trajectories ---------------------------------------------------------------------------------


def test_trajectories_are_the_stages_that_were_done_in_their_order(steady, trajectories):
    """Plans have two stages of each skill, which must not be mixed up."""
    lengths = {"Pick": [], "Put": []}
    for index in range(6):
        task = task_with_goal(steady, DEMONSTRATION_SEED, index)
        for stage in roll_out(steady, task, index, steady.operators, steady.skills).stages:
            assert stage.done
            lengths[stage.operator].append(stage.steps)
    for name, some in trajectories.items():
        assert [len(one.actions) for one in some] == lengths[name]


def test_an_action_is_what_the_skill_does_in_the_observation(steady, trajectories):
    for name, some in trajectories.items():
        for one in some:
            assert np.array_equal(steady.skills[name].policy.mean(one.observations), one.actions)


def test_a_skill_that_never_succeeds_shows_nothing_to_imitate():
    domain = with_skills(PICKING, DROPPING)
    with pytest.raises(UnsolvableError, match="Put of points succeeded in none of 20 tasks"):
        record_trajectories(domain, "", domain.skills, 1)


# -- clones ---------------------------------------------------------------------------------------


def test_clones_solve_tasks_that_were_not_shown(steady, clones):
    skills = {name: clone.skill for name, clone in clones.items()}
    rollouts = [
        roll_out(steady, steady.task(500, index), index, steady.operators, skills)
        for index in range(10)
    ]
    assert np.mean([one.progress for one in rollouts]) > 0.9


def test_a_clone_of_what_nobody_did_solves_nothing(steady, trajectories):
    """It is the actions that are learned: with those of other observations, nothing is."""
    turned = {
        name: [type(one)(one.observations, -one.actions) for one in some]
        for name, some in trajectories.items()
    }
    clones = clone_skills(steady.skills, turned, SHORT, 0)
    skills = {name: clone.skill for name, clone in clones.items()}
    for index in range(5):
        task = steady.task(500, index)
        assert roll_out(steady, task, index, steady.operators, skills).progress == 0.0


def test_clones_keep_operator_horizon_and_network(steady, clones):
    for name, clone in clones.items():
        original = steady.skills[name]
        assert clone.skill.operator is original.operator
        assert clone.skill.horizon == original.horizon
        shapes = [weights.shape for weights, _ in clone.skill.policy.layers]
        assert shapes == [weights.shape for weights, _ in original.policy.layers]


def test_a_seed_gives_a_clone_and_nobody_elses_random_numbers_change(trajectories):
    observations = np.concatenate([one.observations for one in trajectories["Pick"]])
    actions = np.concatenate([one.actions for one in trajectories["Pick"]])
    brief = CloningSettings(updates=3)

    def weights(seed):
        return clone_policy(observations, actions, [4], brief, seed).layers[0][0]

    before = torch.get_rng_state()
    first = weights(0)
    assert torch.equal(torch.get_rng_state(), before)
    torch.manual_seed(7)
    assert np.array_equal(weights(0), first)
    assert not np.array_equal(weights(1), first)


@pytest.mark.parametrize("name", ["updates", "batch_size"])
def test_settings_that_learn_nothing_are_refused(name):
    with pytest.raises(InvalidParameterError, match=f"{name} is 0"):
        CloningSettings(**{name: 0})


# -- the study ------------------------------------------------------------------------------------


def study(output, *arguments):
    pytest.importorskip("matplotlib")
    words = ["study", "imitation", "points", "--tasks", 3, "--output", output, *arguments]
    return CliRunner().invoke(app, list(map(str, words)))


@pytest.mark.slow
@pytest.mark.timeout(120)  # clones both skills with as many updates as figures have
@pytest.mark.usefixtures("points_installed")
def test_the_study_puts_skills_and_clones_side_by_side(tmp_path):
    library = write_library(tmp_path / "steady")
    ran = study(tmp_path, "--library", library, "--trajectories", 12)
    assert ran.exit_code == 0, ran.output
    data = json.loads((tmp_path / "imitation_points.json").read_text())
    rows = data["found"]["rows"]
    kinds = [("lg_sail", None), ("tamp_imitation", 12)]
    assert [(row["method"], row["trajectories"]) for row in rows] == kinds * (len(rows) // 2)
    assert all(len(one["tasks"]) == 3 for row in rows for one in row["libraries"])
    assert {row["solved"] for row in rows} == {1.0}
    assert "| `tamp_imitation` | 12 | 1 × 3 |" in (tmp_path / "imitation_points.md").read_text()


@pytest.mark.usefixtures("points_installed")
def test_a_library_that_never_succeeds_is_refused_and_nothing_is_written(tmp_path):
    library = write_library(tmp_path / "bad", PICKING, DROPPING)
    ran = study(tmp_path / "out", "--library", library, "--trajectories", 1)
    assert ran.exit_code == ErrorCode.UNSOLVABLE
    assert "nothing to imitate" in " ".join(ran.stderr.split())
    assert not (tmp_path / "out" / "imitation_points.json").exists()
