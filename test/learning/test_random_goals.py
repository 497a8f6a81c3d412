# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Goals that can be reached and do not hold already, for the same tasks."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.learning.random_goals import RandomGoalsChoice, sample_goals
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import Problem
from slap_ros.skills.domain_choice import DomainChoice

CHOICE = DomainChoice("obstacle2d", "fair")
DOMAIN = get_domain("obstacle2d")
TASKS = 40


def goals_of(task, count, seed=0):
    return sample_goals(DOMAIN, task, count, np.random.default_rng(seed))


@pytest.mark.parametrize("index", range(4))
def test_goals_are_different_not_there_yet_reachable_and_the_same_again(index):
    task = DOMAIN.task(0, index)
    goals = goals_of(task, 15)
    assert len(goals) == len(set(goals)) == 15
    assert goals == goals_of(task, 15) != goals_of(task, 15, seed=1)
    space = Problem.of(DOMAIN, task.initial_state).model.space
    start = space.abstract(task.initial_state)
    planner = make_planner("lazy", DOMAIN, task.initial_state)
    for goal in goals:
        mask = space.mask(goal)
        assert 1 <= len(goal) <= 2
        assert mask & start == 0 == mask & space.static
        assert planner.plan(task.initial_state, mask).plan.edges


def test_where_there_are_fewer_goals_than_asked_for_all_of_them_are_taken():
    task = DOMAIN.task(1)
    every = goals_of(task, 1000)
    assert 15 < len(every) == len(set(every)) < 1000
    assert set(every) == set(goals_of(task, 1000, seed=1))


@pytest.mark.parametrize(("share", "fewest", "most"), [(0.0, 0, 0), (0.5, 10, 30), (1.0, 38, 40)])
def test_a_share_of_the_tasks_has_another_goal_and_all_begin_as_they_did(share, fewest, most):
    domain = RandomGoalsChoice.of_choice(CHOICE, share).make()
    others = 0
    for index in range(TASKS):
        own, task = DOMAIN.task(7, index), domain.task(7, index)
        assert task.initial_state == own.initial_state
        assert task.goal == domain.task(7, index).goal
        others += task.goal != own.goal
    assert fewest <= others <= most


def test_other_goals_tell_a_domain_from_others():
    shares = (0.0, 0.5, 1.0)
    identities = [dict(RandomGoalsChoice.of_choice(CHOICE, share).identity) for share in shares]
    assert len({tuple(identity.items()) for identity in identities}) == len(shares)
