# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What it takes from a state that no operator leads to, on to a goal: executed in the model.

Within the graph, the mean cost of each operator tells enough. A hand that has just pushed something
off its place is already where the next skill acts, and that saves as much as the push. Or things
lie so that the next skill fails. So one way on is tried, the one that looks cheapest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from slap_ros.errors import InvalidStateError, PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.look_ahead import costs_to_go
from slap_ros.planning.problem import Problem
from slap_ros.relational import State

MAX_NODES = 2_000  # abstract states after which a way on is given up
NO_WAY = float("inf")


class WayOn:
    """Measures the way on to a task's goal, from any state of the task."""

    def __init__(self, problem: Problem, goal: int) -> None:
        """Know no way yet.

        Args:
            problem: Operators and model over the task's objects.
            goal: Atoms of the goal, a mask.
        """
        self._problem, self._goal = problem, goal
        self._graphs: dict[int, AbstractGraph | None] = {}
        self.steps = 0  # environment steps so far

    def measure(
        self,
        state: State,
        node: int,
        operator_steps: Mapping[str, float],
        budget: float = float("inf"),
    ) -> float:
        """Execute the way on that looks cheapest.

        Args:
            state: State in which the way begins.
            node: Abstract state that stands for the state, a mask; more atoms may hold.
            operator_steps: Mean environment steps of each operator, by name.
            budget: Environment steps that may be taken; no skill is begun that could take more.

        Returns:
            Environment steps; infinite where there is no way, a skill on it fails or cannot begin,
            or it could take more than the budget.
        """
        graph = self._graph(node)
        if graph is None:
            return NO_WAY
        to_go, forward = steps_to_goal(graph, operator_steps), graph.forward_edges()
        goals, at, total = set(graph.goal_nodes), 0, 0
        cost = cost_of_edges(operator_steps)
        while at not in goals:
            edge = min(forward[at], key=lambda e: cost(e) + to_go[e.target], default=None)
            if edge is None or total + edge.option.skill.step_limit > budget:
                return NO_WAY
            target = edge.option.target(graph.nodes[edge.target])
            try:
                rollout = self._problem.model.roll_out(edge.option, state, target)
            except InvalidStateError:  # pushed into one another so far that nothing can begin there
                return NO_WAY
            self.steps += rollout.steps
            if not rollout.reached:
                return NO_WAY
            state, at, total = rollout.final, edge.target, total + rollout.steps
        return float(total)

    def _graph(self, node: int) -> AbstractGraph | None:
        """The graph from an abstract state to the goal; None where operators do not lead there."""
        if node not in self._graphs:
            try:
                graph = build_abstract_graph(
                    node, self._goal, self._problem.operators, max_nodes=MAX_NODES
                )
            except (UnsolvableError, PlanningLimitError):
                graph = None
            self._graphs[node] = graph
        return self._graphs[node]


def cost_of_edges(operator_steps: Mapping[str, float]) -> Callable[[Edge], float]:
    """A function that gives an edge's mean environment steps; without any, the mean of others.

    Args:
        operator_steps: Mean environment steps of each operator, by name.
    """
    usual = float(np.mean(list(operator_steps.values()) or [1.0]))
    return lambda edge: operator_steps.get(edge.option.skill.name, usual)


def steps_to_goal(graph: AbstractGraph, operator_steps: Mapping[str, float]) -> list[float]:
    """Estimated environment steps from each node to a goal; infinite where there is no way.

    Operators count with their mean, and those without one with the mean of the others.
    """
    cost = cost_of_edges(operator_steps)
    to_go = costs_to_go(graph.edges, len(graph.nodes), graph.goal_nodes, cost)
    return [NO_WAY if steps is None else float(steps) for steps in to_go]
