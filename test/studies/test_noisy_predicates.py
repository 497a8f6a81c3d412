# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans while the threshold of what blocks a finger is another in each step."""

import json
from itertools import chain, repeat

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.planning.execution import Executor
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.slap import noisy_predicates
from slap_ros.studies.slap.noisy_predicates import RANGES, DrawnThresholds, ThresholdRange
from slap_ros.studies.slap.varying_thresholds import VaryingExecutor, foresee
from support.slap_command import slap

SETUP = PlanningSetup(DomainChoice("cluttered_drawer", "fair:obstacles=4"), "lazy", PURE_PLANNING)
DOMAIN = SETUP.make_domain()
TASK = DOMAIN.task(3)
NOTHING_BLOCKS = get_domain("cluttered_drawer", "fair:obstacles=4,reach=0.001,half_width=0.001")


def planned(domain):
    """A plan for the task under a domain's thresholds, with what was foreseen of it."""
    state = TASK.initial_state
    space = domain.atom_space(state)
    plan = SETUP.make_planner(domain, state).plan(state, space.mask(TASK.goal)).plan
    return foresee(domain, space, state, plan), space


@pytest.fixture(scope="module")
def nominal():
    return planned(DOMAIN)


def executed(draws):
    """An episode under these domains, one a step, with those for which a planner was made."""
    made = []

    def make_planner(domain, state):
        made.append(domain)
        return SETUP.make_planner(domain, state)

    return *VaryingExecutor(iter(draws).__next__, make_planner, 30).run(DOMAIN, TASK), made


def blocked(domain):
    space = domain.atom_space(TASK.initial_state)
    atoms = space.decode(space.abstract(TASK.initial_state))
    return {str(one) for one in atoms if str(one).startswith("Blocking")}


def test_thresholds_are_drawn_within_the_range_and_nothing_else_changes():
    thresholds = DrawnThresholds(SETUP, ThresholdRange(0.5, 1.0, {}), np.random.default_rng(1))
    drawn = [thresholds.draw() for _ in range(20)]
    factors = [float(one.configuration["reach"]) / 0.048 for one in drawn]
    assert 0.5 <= min(factors) < 0.6 < 0.9 < max(factors) <= 1.0
    for one, factor in zip(drawn, factors, strict=True):
        assert float(one.configuration["half_width"]) == pytest.approx(factor * 0.016)
        assert one.configuration["obstacles"] == DOMAIN.configuration["obstacles"]
        assert one.task(3).initial_state.key == TASK.initial_state.key
    again = DrawnThresholds(SETUP, ThresholdRange(0.5, 1.0, {}), np.random.default_rng(1))
    assert again.draw().configuration == drawn[0].configuration


def test_another_threshold_is_another_abstract_state():
    assert len(blocked(DOMAIN)) == 4
    assert blocked(NOTHING_BLOCKS) == set()


def test_with_the_nominal_threshold_a_task_is_solved_as_always(nominal):
    foreseen, space = nominal
    world = DOMAIN.make_world(TASK.initial_state)
    planner = SETUP.make_planner(DOMAIN, TASK.initial_state)
    usual = Executor(DOMAIN, planner, world, space, space.mask(TASK.goal), TASK.step_limit).run()
    episode, final, made = executed(repeat(DOMAIN))
    assert usual.success
    assert (episode.failure, episode.steps) == ("", usual.plan_length)
    assert (episode.replans, episode.waits, len(made)) == (0, 0, 1)
    assert final.key == usual.states[-1].key
    assert [one.key for one in foreseen.states] == [one.key for one in usual.states]


def test_a_plan_is_judged_with_the_threshold_of_the_step(nominal):
    foreseen, space = nominal
    other = NOTHING_BLOCKS.atom_space(TASK.initial_state)
    assert foreseen.holds(TASK.initial_state, space)
    assert not foreseen.holds(TASK.initial_state, other)  # its edges end elsewhere
    elsewhere = foreseen.states[1]
    assert not foreseen.holds(elsewhere, space)


def test_an_edge_that_would_end_before_is_not_right_any_more(nominal):
    """Where the target's atoms hold at once, the next skill would begin in another state."""
    foreseen, space = nominal
    edge, end = foreseen.plan.edges[0], foreseen.ends[0]
    abstract = [space.abstract(one) for one in foreseen.states]
    assert foreseen._ends_right(edge, 0, end, abstract)
    early = [abstract[0], *(abstract[end] for _ in abstract[1:])]
    assert not foreseen._ends_right(edge, 0, end, early)


def test_what_watches_plans_with_the_same_threshold_and_waits_for_a_better_one(nominal):
    """As if nothing blocked, there is no plan: fingers meet blocks in the model all the same."""
    usual = len(nominal[0].actions)
    draws = chain(repeat(DOMAIN, 4), repeat(NOTHING_BLOCKS, 3), repeat(DOMAIN))
    episode, final, made = executed(draws)
    assert made == [DOMAIN, *repeat(NOTHING_BLOCKS, 3)]
    assert (episode.failure, episode.replans, episode.waits) == ("", 3, 3)
    assert episode.steps == usual + 3
    assert all(atom.holds(final) for atom in TASK.goal)


def test_an_episode_ends_where_no_threshold_has_a_plan():
    episode, final, _ = executed(repeat(NOTHING_BLOCKS))
    assert episode.failure == "the plan was wrong again after 30 replans"
    assert final.get(TASK.initial_state.layout.by_name["block1"], "z") == pytest.approx(
        TASK.initial_state.get(TASK.initial_state.layout.by_name["block1"], "z"), abs=1e-4
    )


def test_the_page_has_the_papers_figures_beside_ours(tmp_path, monkeypatch):
    monkeypatch.setattr(noisy_predicates, "RANGES", RANGES[2:3])
    arguments = ["study", "noisy_predicates", "cluttered_drawer", "--tasks", "1", "--seeds", "1"]
    arguments += ["--samples", "1", "--preset", "fair:obstacles=1", "--output", str(tmp_path)]
    result = slap(*arguments)
    assert result.exit_code == 0, result.stderr
    data = json.loads((tmp_path / "noisy_predicates_cluttered_drawer.json").read_text())
    rows = {row["approach"]: row for row in data["found"]["rows"]}
    assert list(rows) == ["pure_planning", "slap"]
    assert [row["papers_success_rate"] for row in rows.values()] == [0.54, 0.92]
    for row in rows.values():
        assert row["success_rate"] == np.mean([one["success"] for one in row["attempts"]])
    page = (tmp_path / "noisy_predicates_cluttered_drawer.md").read_text()
    assert "| [0.5w, w] | pure planning |" in page


def test_a_domain_without_such_a_threshold_is_refused(tmp_path):
    arguments = ["study", "noisy_predicates", "obstacle2d", "--output", str(tmp_path)]
    result = slap(*arguments)
    assert result.exit_code == InvalidParameterError.code
    assert "this study is of cluttered_drawer" in " ".join(result.stderr.split())
    assert not list(tmp_path.iterdir())
