# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks solved by planning with the given skills alone, and what holds in a state."""

from __future__ import annotations

from slap_ros.core import Domain, Task
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.planning.planner import make_planner
from slap_ros.relational import State


def executed(task: Task, domain: Domain) -> EpisodeResult:
    """What happens when a task is planned and carried out in the domain's world."""
    space = domain.atom_space(task.initial_state)
    return Executor(
        domain,
        make_planner("lazy", domain, task.initial_state),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
    ).run()


def fluent_atoms(state: State, domain: Domain) -> set[str]:
    """The atoms that hold and that operators may change, as text."""
    space = domain.atom_space(state)
    return {str(atom) for atom in space.decode(space.abstract(state) & ~space.static)}
