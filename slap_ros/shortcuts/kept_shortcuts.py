# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts of an earlier training, which are options like any other in a later one."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.relational import State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.shortcut import Shortcut


@dataclass(frozen=True)
class KeptShortcuts:
    """What a training keeps of an earlier one.

    Args:
        shortcuts: Shortcuts that were learned then.
        sampling: Settings of how they are tried out in the model.
    """

    shortcuts: tuple[Shortcut, ...] = ()
    sampling: Sampling = DEFAULT

    def planner(self, domain: Domain, problem: Problem, initial: State) -> GraphPlanner:
        """A planner of one task, with these shortcuts among its options.

        Args:
            domain: Domain of the task.
            problem: Operators and model over the task's objects.
            initial: State with the objects of the task.
        """
        if not self.shortcuts:
            return GraphPlanner(problem)
        grounded = GroundedShortcuts(domain, self.shortcuts, initial, self.sampling)
        return GraphPlanner(problem, shortcuts=grounded)


NOTHING_KEPT = KeptShortcuts()


def graph_of(planner: GraphPlanner, start: int, goal: int) -> AbstractGraph:
    """The abstract planning graph of a planner, its shortcuts included.

    Args:
        planner: Planner of the task.
        start: Abstract state to start from, a mask.
        goal: Mask of atoms that must hold.

    Raises:
        UnsolvableError: The goal holds in no abstract state that operators reach.
        PlanningLimitError: There are too many abstract states.
    """
    graph = planner.graph(start, goal)
    planner.add_shortcuts(graph)
    return graph
