# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A search whose plan nobody wants any more."""

import itertools

import pytest

pytest.importorskip("pybullet")

from slap_ros.domains import get_domain
from slap_ros.errors import TaskCanceledError
from slap_ros.planning.planner import make_planner

DOMAIN = get_domain("obstacle2d", "fair")
TASK = DOMAIN.task(1)
START, GOAL = TASK.initial_state, DOMAIN.atom_space(TASK.initial_state).mask(TASK.goal)


@pytest.mark.parametrize("name", ["anytime", "lazy", "exhaustive", "ff"])
def test_a_canceled_search_ends_and_what_it_rolled_out_misleads_no_later_one(name):
    plan = make_planner(name, DOMAIN, START).plan(START, GOAL)
    steps, canceled_at = itertools.count(), 7  # in the middle of a roll-out
    planner = make_planner(name, DOMAIN, START, None, lambda: next(steps) == canceled_at)
    with pytest.raises(TaskCanceledError):
        planner.plan(START, GOAL)
    assert next(steps) == canceled_at + 1
    again = planner.plan(START, GOAL)
    assert (again.plan, again.bound) == (plan.plan, plan.bound)
