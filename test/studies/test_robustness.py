# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies of worlds that are not as plans take them to be."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.perception import NoisyPerceiver, Quality
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.slap.perturbed import PerturbedOptions, prepare
from slap_ros.studies.slap.robustness import highest, solve_task
from slap_ros.studies.slap.table1 import under_presets

LIBRARY = Path(__file__).parent.parent.parent / "models" / "shortcuts" / "obstacle_tower"
QUICK = ["--tasks", "1", "--seeds", "1", "--first-seed", "3", "--samples", "1", "--max-replans"]


def without_time(trial):
    return replace(trial, planning_seconds=0.0)


def solved(preset, hides_top, max_replans):
    setup = PlanningSetup(DomainChoice("obstacle_tower", preset), "lazy", PURE_PLANNING)
    return solve_task(setup, hides_top, max_replans, 2, 0)


@pytest.mark.slow
def test_the_same_seed_has_the_same_trial():
    first, again = (without_time(solved("stochastic", False, 1)) for _ in range(2))
    assert first == again
    assert first.plan_length > 0


def test_the_top_block_is_not_in_what_is_planned_from_and_stands_in_the_world():
    domain = get_domain("obstacle_tower")
    task = domain.task(2)
    space, world = domain.atom_space(task.initial_state), domain.make_world(task.initial_state)
    top = highest(task.initial_state)
    on = {str(atom) for atom in space.decode(space.abstract(task.initial_state))}
    assert any(one.startswith(f"On({top}, block") for one in on)
    assert not any(one.startswith("On(") and one.endswith(f", {top})") for one in on)
    quality = Quality(hidden=frozenset({top}))
    rng = np.random.default_rng(0)
    perceiver = NoisyPerceiver.of(domain, space, task.initial_state, quality, rng)
    for _ in range(3):
        percept = perceiver.perceive(world.state)
        assert percept.missing == {top}
        assert top not in percept.state.layout.by_name
        assert top in world.state.layout.by_name
        assert not any(top in str(atom).split("(")[1] for atom in space.decode(percept.abstract))
        world.step(domain.action_space.hold)


@pytest.mark.slow
def test_planning_for_what_is_seen_fails_where_the_tower_is_higher(monkeypatch):
    """Its hand is to grasp the block below the one that nobody sees, and pushes it on its way."""
    monkeypatch.setattr("slap_ros.domains.tabletop.skills.AIM_STEPS", 0)
    trial = solved("fair", True, 1)
    assert not trial.success
    assert trial.reason
    assert solved("fair", False, 1).success


@pytest.mark.slow
def test_the_report_has_our_figures_beside_the_papers(tmp_path):
    arguments = ["study", "stochastic", "obstacle_tower", *QUICK, "0"]
    arguments += ["--library", str(LIBRARY), "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.stderr
    data = json.loads((tmp_path / "stochastic_obstacle_tower.json").read_text())
    assert data["preset"] == "stochastic"
    assert [row["approach"] for row in data["found"]["rows"]] == ["pure_planning", "slap"]
    for row in data["found"]["rows"]:
        trials = [trial for one in row["libraries"] for trial in one["trials"]]
        assert row["replans"]["mean"] == np.mean([trial["replans"] for trial in trials])
        assert row["success_rate"] == np.mean([trial["success"] for trial in trials])
    page = (tmp_path / "stochastic_obstacle_tower.md").read_text()
    assert "| pure planning (the paper's) |  | 84% |  | 293.6 |  | 1.00 |" in page
    assert "| SLAP (the paper's) |  | 92% |  | 119.7 |  | 0.41 |" in page


def test_the_report_says_how_many_steps_each_library_learned_from():
    options = PerturbedOptions(domain="obstacle_tower", libraries=[LIBRARY], trained=[LIBRARY])
    settings = prepare(options, pytest.fail).settings
    learned = json.loads((LIBRARY / "library.json").read_text())["environment_steps"]["learning"]
    for use in ("libraries", "trained_perturbed"):
        assert [one["learning_steps"] for one in settings[use]] == [learned]


def test_a_domain_without_such_a_preset_is_refused(tmp_path):
    arguments = ["study", "perturbed", "cluttered_drawer", *QUICK, "1", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == InvalidParameterError.code
    assert "unknown preset 'perturbed'" in result.stderr
    assert not list(tmp_path.iterdir())


def test_the_main_table_is_of_worlds_as_planned_for():
    presets = [one.preset for one in under_presets("obstacle_tower", None)]
    assert presets == ["fair", "paper"]
    assert [one.preset for one in under_presets("obstacle_tower", ["perturbed"])] == ["perturbed"]
