# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans for where skills fail on every path of the graph.

Where given skills fail, one of them may end in another abstract state than its operator says, if
the model has it reach the goal from there. Where acquired skills fail, the plan may take a detour,
back to an abstract state in which it was before: a skill that fails from one low-level state of it
may well succeed from another. Where every detour fails too, the plan is the one that leaves the
goal nearest where it fails: a skill may well succeed from where it has left the robot, so that to
act and to plan again is better than to give up.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph, build_unrolled_graph
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import FailedPath, SearchOutcome
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.relational import State, Target

SIDE_EFFECTS = 3  # from which is searched on: each search may take as long as the first

SearchTo = Callable[[State, int], tuple[AbstractGraph, SearchOutcome]]


@dataclass(frozen=True)
class Recovery:
    """What can still be planned after a search without success.

    Args:
        problem: The model, and the ground operators with their options.
        graph: The graph in which no path can be executed.
        state: Low-level state to start from.
        goal: Mask of atoms that must hold.
        failed: Paths that failed, in order.
    """

    problem: Problem
    graph: AbstractGraph
    state: State
    goal: int
    failed: Sequence[FailedPath]

    def past_side_effect(self, search_to: SearchTo) -> Plan | None:
        """A plan in which a skill ends in another abstract state than its operator says.

        A block that leans after a slap may slide off when the next one is put down: no operator
        says so, but the model does, and from there the goal may be near, or hold.

        Args:
            search_to: Searches from another state.

        Returns:
            The plan, exact in all its edges; None if there is none.
        """
        model = self.problem.model
        for path in self._nearest()[:SIDE_EFFECTS]:
            *before, last = path.plan.edges
            there = self.state
            for edge in before:
                there = model.roll_out(edge.option, there, edge.target).final
            target = Target.exactly(path.abstract)
            rollout = model.roll_out(last.option, there, target)
            if rollout.steps == 0 or not rollout.reached:
                continue  # it does nothing, or something else by the time it gets there
            with suppress(UnsolvableError, PlanningLimitError):
                _, outcome = search_to(rollout.final, self.goal)
                if outcome.plan is not None:
                    aside = PlanEdge(last.option, target, rollout.steps)
                    return Plan((*before, aside, *outcome.plan.edges))
        return None

    def detour(self, max_extra_depth: int) -> Plan | None:
        """A plan that comes back to an abstract state, without shortcuts; None if there is none.

        Args:
            max_extra_depth: Operators of the detour, at most.
        """
        shortest = self.graph.depth[self.graph.goal_nodes[0]]  # by operators, which come first
        with suppress(UnsolvableError, PlanningLimitError):
            unrolled = build_unrolled_graph(
                self.graph.nodes[0],
                self.graph.goal,
                self.problem.operators,
                shortest + max_extra_depth,
            )
            # Whatever the search: it tries the fewest of so many sequences.
            return search_lazily(unrolled, self.state, self.problem.model).plan
        return None

    def despite_failures(self) -> Plan | None:
        """The plan that leaves the goal nearest where it fails.

        Returns:
            The plan; None if no operators lead to the goal from wherever a path fails.
        """
        for path in self._nearest():
            rest = self._symbolic.edges(self.graph.nodes[path.node], self.goal)
            return Plan((*path.plan.edges, *rest))
        return None

    def _nearest(self) -> list[FailedPath]:
        """The paths that fail where operators still lead to the goal, those with fewest first."""
        to_go: dict[int, int] = {}
        nearest: list[tuple[int, int, int, FailedPath]] = []
        for number, path in enumerate(self.failed):
            with suppress(UnsolvableError, PlanningLimitError):
                if path.abstract not in to_go:
                    to_go[path.abstract] = len(self._symbolic.edges(path.abstract, self.goal))
                key = to_go[path.abstract], path.plan.predicted_steps, number
                nearest.append((*key, path))
        return [path for *_, path in sorted(nearest)]

    @property
    def _symbolic(self) -> SymbolicPlanner:
        return SymbolicPlanner(self.problem.model.space, self.problem.operators)
