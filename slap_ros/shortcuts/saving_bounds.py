# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What shortcuts could save at most: plans in which a shortcut takes no steps at all.

A shortcut from node i to node j of the abstract planning graph saves at most the plan's length,
less the way to i and the way on from j. Ways are valued as exploration values the way on: by the
mean environment steps of each operator.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.shortcuts.way_on import cost_of_edges, steps_to_goal

Operators = tuple[str, ...]
NO_WAY: tuple[float, Operators] = (math.inf, ())


@dataclass(frozen=True)
class SavingBound:
    """What a shortcut from one node to another saves at most.

    Args:
        replaced: Names of the operators that lead from the first node to the second, by the
            cheapest way; none where no operators do.
        pair: Indices of both nodes.
        steps: Environment steps of these operators; infinite where there are none.
        saving: Environment steps that a shortcut between both saves if it takes none itself.
    """

    replaced: Operators
    pair: tuple[int, int]
    steps: float
    saving: float


def saving_bounds(graph: AbstractGraph, operator_steps: Mapping[str, float]) -> list[SavingBound]:
    """The bound of each pair of nodes that no option joins and a shortcut could be worth joining.

    Args:
        graph: Abstract planning graph of a task, without shortcuts.
        operator_steps: Mean environment steps of each operator, by name.

    Returns:
        Bounds, the largest saving first.
    """
    ways = _CheapestWays(graph, cost_of_edges(operator_steps))
    to_go, from_start = steps_to_goal(graph, operator_steps), ways.leading_from(0)
    bounds = []
    for i, j in graph.candidates():
        saving = to_go[0] - from_start[i][0] - to_go[j]
        if saving > 0.0:
            steps, replaced = ways.leading_from(i).get(j, NO_WAY)
            bounds.append(SavingBound(replaced, (i, j), steps, saving))
    return sorted(bounds, key=lambda bound: (-bound.saving, bound.pair))


class _CheapestWays:
    """The cheapest ways through a graph, from any node."""

    def __init__(self, graph: AbstractGraph, cost: Callable[[Edge], float]) -> None:
        self._outgoing: list[list[Edge]] = [[] for _ in graph.nodes]
        for edge in graph.edges:
            self._outgoing[edge.source].append(edge)
        self._cost = cost
        self._known: dict[int, dict[int, tuple[float, Operators]]] = {}

    def leading_from(self, node: int) -> Mapping[int, tuple[float, Operators]]:
        """Environment steps and operators to each node that can be reached from one (Dijkstra)."""
        if node not in self._known:
            self._known[node] = self._dijkstra(node)
        return self._known[node]

    def _dijkstra(self, start: int) -> dict[int, tuple[float, Operators]]:
        reached: dict[int, tuple[float, Operators]] = {}
        queue: list[tuple[float, Operators, int]] = [(0.0, (), start)]
        while queue:
            steps, operators, node = heapq.heappop(queue)
            if node in reached:
                continue
            reached[node] = steps, operators
            for edge in self._outgoing[node]:
                way = (*operators, edge.option.skill.name)
                heapq.heappush(queue, (steps + self._cost(edge), way, edge.target))
        return reached
