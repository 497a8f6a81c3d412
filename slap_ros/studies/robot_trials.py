# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks solved in closed loop by a robot whose states are measured."""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.core import Domain, Task
from slap_ros.errors import SlapError
from slap_ros.evaluation.experiment import Trial
from slap_ros.perception import ExactPerceiver
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.planner import Planner
from slap_ros.relational import State
from slap_ros.robot.measured_world import MeasuredWorld


def solve_on_robot(
    domain: Domain,
    task: Task,
    make_planner: Callable[[Domain, State], Planner],
    make_world: Callable[[Domain, State], MeasuredWorld],
) -> Trial:
    """Plan for what is measured on a robot, and execute the plan there.

    Args:
        domain: Domain whose states are measured.
        task: Task of the domain.
        make_planner: Makes the planner, of the domain and a state with its objects.
        make_world: Makes the robot's world, of the domain and the state that it begins in.

    Returns:
        What came of it; a robot that holds after a fault has not solved its task.
    """
    try:
        world = make_world(domain, task.initial_state)
    except SlapError as error:  # nothing was measured
        return Trial.of(task.seed, task.index, _ended_by(error))
    try:
        world.require_seen(task.goal)
        space = domain.atom_space(world.state)
        planner = make_planner(domain, world.state)
        goal, perceiver = space.mask(task.goal), ExactPerceiver(space, changing=True)
        episode = Executor(
            domain, planner, world, space, goal, task.step_limit, perceiver=perceiver
        ).run()
    except SlapError as error:  # a fault, after which the robot holds
        episode = _ended_by(error)
    finally:
        world.close()
    return Trial.of(task.seed, task.index, episode)


def _ended_by(error: SlapError) -> EpisodeResult:
    return EpisodeResult(error=OptionResult(error.code, str(error)))
