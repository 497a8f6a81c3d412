# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run of the planner that is overtaken by another episode."""

import asyncio
from types import SimpleNamespace

from ensemble.observation import Episode, Observation
from planner_node.task_execution import TaskExecution
from slap_ros.domains import get_domain
from slap_ros.errors import EpisodeChangedError, ErrorCode

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
