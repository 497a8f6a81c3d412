# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether shortcuts still hold: they are tried where planning tries them, with skills as they are.

A shortcut begins where a skill ended. So a shortcut that was learned over some skills may fail
over others, which leave other states.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from slap_ros.core import Domain, Task
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.settings import ENOUGH_SUCCESS
from slap_ros.shortcuts.shortcut import Shortcut

TRIALS = replace(DEFAULT, alternatives=1, refinements=0)  # nothing that only makes it shorter


@dataclass(frozen=True)
class ShortcutTrials:
    """The trials of a shortcut in states of the planner's graph.

    Args:
        name: Name of the shortcut.
        states: Number of states in which the shortcut was tried.
        reached: Number of states from which the shortcut reached its target.
    """

    name: str
    states: int
    reached: int

    @property
    def holds(self) -> bool:
        """Whether the shortcut was tried, and reached its target often enough."""
        return self.states > 0 and self.reached >= ENOUGH_SUCCESS * self.states


def try_in_task(
    domain: Domain, task: Task, shortcuts: Sequence[Shortcut]
) -> Mapping[str, Counter[bool]]:
    """Plan with shortcuts, and count what each of them came to where the search tried it.

    Args:
        domain: Domain with the skills to plan with.
        task: Task to plan for.
        shortcuts: Shortcuts to try.

    Returns:
        The number of states from which a shortcut reached its target, under True, and of those
        from which it did not, under False; by the shortcut's name.

    Raises:
        SlapError: The task has no plan.
    """
    initial = task.initial_state
    problem = Problem.of(domain, initial)
    grounded = GroundedShortcuts(domain, shortcuts, initial, TRIALS)
    planner = GraphPlanner(problem, shortcuts=grounded)
    planner.plan(initial, problem.model.space.mask(task.goal))
    counts: dict[str, Counter[bool]] = {shortcut.name: Counter() for shortcut in shortcuts}
    for name, successes in grounded.cached_rollouts():
        counts[name][bool(successes)] += 1
    return counts


def trials_of(tried: Sequence[Mapping[str, Counter[bool]]]) -> tuple[ShortcutTrials, ...]:
    """The trials of each shortcut in all tasks together, in order of the shortcuts.

    Args:
        tried: Results of :func:`try_in_task`, one for each task.
    """
    sums: dict[str, Counter[bool]] = {}
    for counts in tried:
        for name, count in counts.items():
            sums[name] = sums.get(name, Counter()) + count
    return tuple(
        ShortcutTrials(name, count[True] + count[False], count[True])
        for name, count in sums.items()
    )
