# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans: edges to be executed one after the other."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.planning.options import Option
from slap_ros.relational import Target


@dataclass(frozen=True)
class PlanEdge:
    """One edge: an option and where it shall end."""

    option: Option
    target: Target
    predicted_steps: int  # environment steps in the planner's model

    def __str__(self) -> str:
        return str(self.option)


@dataclass(frozen=True)
class Plan:
    """Edges in order of execution; empty where the goal already holds."""

    edges: tuple[PlanEdge, ...]

    @property
    def predicted_steps(self) -> int:
        """Environment steps in the planner's model."""
        return sum(edge.predicted_steps for edge in self.edges)


@dataclass(frozen=True)
class PlanningResult:
    """A plan and the effort of finding it.

    Args:
        plan: What was found.
        graph_nodes: Abstract states in the graph.
        graph_edges: Options in the graph.
        edges_rolled_out: Options simulated in the model.
        fails: Why no plan can be executed in the model, where this one fails there as well; empty
            where it reaches the goal.
    """

    plan: Plan
    graph_nodes: int
    graph_edges: int
    edges_rolled_out: int
    fails: str = ""
