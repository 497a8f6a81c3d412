# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States in which a learned skill would begin, and what constant policies achieve from there."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Action, Domain, Policy, Task, World
from slap_ros.relational import LiftedOperator, Object, State

STEP_LIMIT = 300  # environment steps of an approach or a script
CONSTANT = {
    "nothing": np.zeros(5),
    "open": np.array([0.0, 0.0, 0.0, 0.0, -1.0]),
    "close": np.array([0.0, 0.0, 0.0, 0.0, 1.0]),
    "down": np.array([0.0, 0.0, -0.02, 0.0, 0.0]),
}


def skill_starts(
    domain: Domain, task: Task
) -> dict[LiftedOperator, tuple[tuple[Object, ...], State]]:
    """The objects and the state after the approach of each operator, for tasks of two options."""
    acquisition = domain.acquisition
    (goal,) = task.goal
    world = domain.make_world(task.initial_state)
    found = {}
    for operator, objects in zip(
        acquisition.operators, (goal.objects[:1], goal.objects), strict=True
    ):
        before = world.state
        _carry_out(world, acquisition.approach(before, objects))
        found[operator] = (objects, world.state)
        world.reset(before)
        _carry_out(world, acquisition.scripts[operator.name](before, objects))
    return found


def achieves(
    domain: Domain,
    operator: LiftedOperator,
    objects: tuple[Object, ...],
    start: State,
    action: Action,
) -> bool:
    """Whether an action, repeated over the horizon, reaches what an operator says."""
    binding = dict(zip(operator.parameters, objects, strict=True))
    world = domain.make_world(start)
    for _ in range(domain.acquisition.horizon):
        state = world.step(action)
        if all(a.ground(binding).holds(state) for a in operator.add_effects) and not any(
            a.ground(binding).holds(state) for a in operator.delete_effects
        ):
            return True
    return False


def _carry_out(world: World, policy: Policy) -> None:
    for _ in range(STEP_LIMIT):
        action = policy(world.state)
        if action is None:
            return
        world.step(action)
