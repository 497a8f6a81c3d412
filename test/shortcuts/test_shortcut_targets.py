# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts among options that let other atoms appear: what came along does not strand them."""

from dataclasses import replace
from pathlib import Path

import pytest

from slap_ros.evaluation.approaches import approaches
from slap_ros.planning.model import Model
from slap_ros.relational import Target
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut_library import load_library
from support.pushing import DOMAIN, start_of

LIBRARY = load_library(Path(__file__).parent / "data" / "obstacle2d", DOMAIN)
LOOSE = replace(DOMAIN, exact=False)  # other atoms may appear
SAMPLING = Sampling(samples=4)


@pytest.fixture(scope="module")
def begun():
    """Where a shortcut begins, and the abstract state of its node: one atom fewer holds there."""
    start = start_of(0)
    abstract = start.space.abstract(start.state)
    others = abstract & ~start.space.static & ~start.change.delete
    extra = start.space.mask([next(iter(start.space.decode(others)))])
    return start, abstract, abstract & ~extra


def test_a_shortcut_is_asked_for_what_its_change_says_and_for_what_its_node_has(begun):
    start, abstract, node = begun
    (shortcut,) = LIBRARY.shortcuts
    grounded = GroundedShortcuts(LOOSE, LIBRARY.shortcuts, start.state, SAMPLING)
    usual = grounded.option(shortcut.name, abstract, Target.exactly(start.target))
    planned = usual.target(start.change.apply(node))
    assert planned == Target(start.change.apply(node), start.change.delete)
    # From where more holds than its node says, it is the same shortcut for the same change.
    assert grounded.option(shortcut.name, abstract, planned) == usual
    assert grounded.option(shortcut.name, abstract, Target.exactly(planned.required)) is None
    rollout = Model.of(LOOSE, start.state).roll_out(usual, start.state, planned)
    assert rollout.reached
    assert rollout.abstract == start.target  # nothing was lost


@pytest.mark.slow
def test_plans_with_shortcuts_are_the_same_where_more_is_allowed():
    """What was learned changes what it says, so that it makes no difference."""
    for index in range(8):
        task = DOMAIN.task(1, index)
        goal = DOMAIN.atom_space(task.initial_state).mask(task.goal)
        plans = []
        for domain in (DOMAIN, LOOSE):
            planner = approaches(LIBRARY, SAMPLING)[-1].planner("lazy", domain, task.initial_state)
            plan = planner.plan(task.initial_state, goal).plan
            plans.append([(str(e), e.target.required, e.predicted_steps) for e in plan.edges])
        assert plans[0] == plans[1]
