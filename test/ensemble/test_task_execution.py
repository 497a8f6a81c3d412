# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run of the planner: what its result says, and that another episode may overtake it."""

import asyncio
from types import SimpleNamespace

import pytest

from ensemble.observation import Episode, Observation
from planner_node.run_statistics import RunStatistics
from planner_node.task_execution import TaskExecution
from slap_ros.domains import get_domain
from slap_ros.errors import EpisodeChangedError, ErrorCode
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import hold_option
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult

DOMAIN = get_domain("obstacle2d")
TASK = DOMAIN.task(0)
SPACE = DOMAIN.atom_space(TASK.initial_state)


def seen(episode, step):
    number = Episode(episode, 0, DOMAIN, TASK, SPACE)
    return Observation(number, step, TASK.initial_state, SPACE.abstract(TASK.initial_state))


def test_a_run_whose_episode_is_over_ends_with_that_and_with_no_steps_fewer_than_none():
    """It began late in the old episode; the new one counts from 0, and lengths are unsigned."""
    synchronizer = SimpleNamespace(latest=seen(1, 28))
    run = TaskExecution(
        node=None,
        goal=SimpleNamespace(request=SimpleNamespace(max_replans=0)),
        synchronizer=synchronizer,
        publisher=SimpleNamespace(event=lambda *_, **__: 0),
        skills=None,
        skill_server=None,
        workers=None,
        planner=None,
        provenance={},
        goal_mask=0,
        step_limit=50,
    )

    async def overtaken():
        synchronizer.latest = seen(2, 0)
        raise EpisodeChangedError("the simulator was reset during the run")

    run._plan_and_execute = overtaken
    result = asyncio.run(run.run())
    assert result.error_code == ErrorCode.EPISODE_CHANGED
    assert result.plan_length == 0


def planned(steps, at_least):
    hold = hold_option(DOMAIN.action_space)
    plan = Plan((PlanEdge(hold, hold.target(0), steps),))
    return PlanningResult(plan, 2, 1, edges_rolled_out=5, at_least=at_least)


@pytest.mark.parametrize(("at_least", "bound"), [(0, 0.0), (7, 10 / 7), (10, 1.0)])
def test_the_result_has_the_sums_of_all_plans_and_the_bound_of_the_first(at_least, bound):
    statistics = RunStatistics(first_step=3)
    assert statistics.result(3, OptionResult(ErrorCode.UNSOLVABLE)).bound == 0.0
    statistics.add(planned(10, at_least), 1_000_000_000)
    statistics.add(planned(9, 8), 500_000_000)
    result = statistics.result(22, OptionResult(ErrorCode.NONE))
    assert (result.plan_length, result.edges_rolled_out) == (19, 10)
    assert (result.planning_seconds, result.bound) == (1.5, bound)
