# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The demonstrator, which solves tasks with hand-written operators and scripts.

It plans with A* over the operators alone, and again from wherever a script has left the robot. So
it proves that a task can be solved, and records how. No skill learns from it.
"""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import Domain, Task
from slap_ros.errors import UnsolvableError
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.planning.problem import ground_options
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.relational import AtomSpace, GroundAtom

DEMONSTRATION_SEED = 3_000_000  # neither evaluation nor training sees these tasks
MOST_FAILED = 20  # number of demonstrations in a row of which none solves its task

AtomTrace = tuple[frozenset[GroundAtom], ...]  # atoms that hold in each step


@dataclass(frozen=True)
class Demonstration:
    """A demonstration: what the demonstrator did for one task."""

    space: AtomSpace
    episode: EpisodeResult

    @property
    def trace(self) -> AtomTrace:
        """The atoms that held, step by step."""
        masks = map(self.space.abstract, self.episode.states)
        return tuple(frozenset(self.space.decode(mask)) for mask in masks)


def demonstrate(
    domain: Domain, task: Task, goal: frozenset[GroundAtom] | None = None
) -> Demonstration:
    """Solve a task in a world of its own.

    Args:
        domain: Domain with scripts for skills, as
            :func:`~slap_ros.skills.domain_choice.open_domain` makes it.
        task: Task with the initial state and the step limit.
        goal: Goal to reach; None for the task's own goal.

    Returns:
        What happened; its episode says whether the goal was reached.

    Raises:
        NoSkillsError: The domain has no operators.
        InvalidStateError: The world refuses the task's state.
    """
    space = domain.atom_space(task.initial_state)
    executor = Executor(
        domain,
        SymbolicPlanner(space, ground_options(domain, space)),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal if goal is None else goal),
        task.step_limit,
    )
    return Demonstration(space, executor.run())


def record_traces(domain: Domain, count: int, goal: str | None = None) -> list[AtomTrace]:
    """Demonstrations that solve their tasks, as atoms step by step.

    Args:
        domain: Domain with scripts for skills.
        count: Number of demonstrations.
        goal: Name of the goal; None for the goals that come with tasks.

    Returns:
        As many, of different tasks, always the same.

    Raises:
        UnsolvableError: The demonstrator fails too often.
        NoSkillsError: The domain has no operators.
        UnknownGoalError: The domain has no goal of that name.
    """
    traces: list[AtomTrace] = []
    failed = index = 0
    while len(traces) < count:
        shown = demonstrate(domain, domain.task(DEMONSTRATION_SEED, index, goal))
        index += 1
        if shown.episode.success:
            traces.append(shown.trace)
            failed = 0
            continue
        failed += 1
        if failed == MOST_FAILED:
            raise UnsolvableError(
                f"the demonstrator of {domain.name} solved none of {failed} tasks in a row; the "
                f"last one ended with: {shown.episode.error.reason}"
            )
    return traces
