# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""About as many steps are kept for exploration as it takes, and it takes no more than it may."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slap_ros.api.growth import GrowthRequest
from slap_ros.domains import get_domain
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.named_settings import APPROACHES
from slap_ros.shortcuts.named_settings import NEAR as NEAR_SETTINGS

MODELS = Path(__file__).parents[2] / "models/grown"
NEAR = ExplorationSettings(
    rollouts=8, length=12, nodes=4, action_repeat=4, also_repeat=2, pushes=1, inside=4, beyond=True
)


@pytest.mark.parametrize("library", sorted(MODELS.rglob("shortcuts/library.json")), ids=str)
def test_growing_keeps_about_as_many_steps_for_exploration_as_it_has_taken(library):
    """Pushes, and rollouts from inside skills, are ten times as many as random rollouts."""
    domain = get_domain("stack_at_target", "fair:blocked=1")
    taken = json.loads(library.read_text())["environment_steps"]["exploring"]
    assert GrowthRequest(domain, Path("grown")).exploration_steps == pytest.approx(taken, rel=0.1)


@pytest.mark.parametrize(
    "library", sorted((MODELS.parent / "approaches").rglob("shortcuts/library.json")), ids=str
)
def test_with_approaches_it_keeps_no_less_and_no_more_than_twice_as_many(library):
    """Those that do not arrive, or whose pushes fail early, take fewer."""
    domain = get_domain("make_coffee", "fair")
    taken = json.loads(library.read_text())["environment_steps"]["exploring"]
    request = GrowthRequest(domain, Path("grown"), shortcut_settings=APPROACHES)
    assert taken <= request.exploration_steps <= 2 * taken


@pytest.mark.parametrize("settings", [NEAR_SETTINGS, APPROACHES])
@pytest.mark.parametrize("spare", [0, 1, 5_000, 100_000])
def test_a_shortcut_can_be_paid_whatever_exploration_takes(spare, settings):
    domain = get_domain("stack_at_target", "fair:blocked=1")
    budget = ["exploration.budget=20000"]
    request = GrowthRequest(
        domain, Path("grown"), shortcut_settings=settings, shortcut_changes=budget
    )
    left = request.least_shortcut_steps + spare
    with_budgets = replace(request, shortcut_changes=request.affordable_changes(left)).training
    exploration = with_budgets.exploration
    assert with_budgets.budget == left and exploration.budget <= 20_000
    assert exploration.tasks * exploration.budget + with_budgets.steps_per_shortcut <= left


def explore(settings):
    rng = np.random.default_rng(0)
    return Explorer.of_task(get_domain("obstacle2d"), 1_000_000, 0, settings, rng).explore()


@pytest.fixture(scope="module")
def everything():
    return explore(NEAR)


@pytest.mark.parametrize("share", [0.35, 0.9])
def test_exploration_takes_no_more_than_its_budget_and_most_of_it(everything, share):
    """It begins with what is cheapest to reach, and finds there what it finds without a budget."""
    budget = round(share * everything.environment_steps)
    part = explore(replace(NEAR, budget=budget))
    assert 0.5 * budget < part.environment_steps <= budget
    found = [each.as_json() for each in everything.candidates]
    assert [each.as_json() for each in part.candidates] == found[: len(part.candidates)]
