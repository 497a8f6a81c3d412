# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What leads to a goal in an abstract graph, and how many steps that takes from each node."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

from slap_ros.planning.abstract_graph import AbstractGraph, Edge

Cost = TypeVar("Cost", int, float)


@dataclass(frozen=True)
class LookAhead:
    """What leads to a goal in a graph: the same for every search in it.

    Args:
        goals: Indices of the goal nodes.
        forward: Edges out of each node through which a goal can be reached.
        steps_to_go: Lower bound of the steps from each node to a goal; None without a way.
    """

    goals: frozenset[int]
    forward: Sequence[Sequence[Edge]]
    steps_to_go: Sequence[int | None]

    @classmethod
    def of(cls, graph: AbstractGraph) -> LookAhead:
        """Along all forward edges of a graph."""
        return cls.along(graph.forward_edges(), frozenset(graph.goal_nodes))

    @classmethod
    def along(cls, edges: Sequence[Sequence[Edge]], goals: frozenset[int]) -> LookAhead:
        """Along these edges out of each node, to these goal nodes."""
        every = chain.from_iterable(edges)
        steps_to_go = costs_to_go(every, len(edges), goals, lambda e: e.option.skill.least_steps)
        leading = [[e for e in out if steps_to_go[e.target] is not None] for out in edges]
        return cls(goals, leading, steps_to_go)

    def without_given_up(self) -> LookAhead:
        """The same without the options that were given up, and the bounds that counted on them."""
        left = [[e for e in out if not e.option.given_up()] for out in self.forward]
        return LookAhead.along(left, self.goals)


def costs_to_go(
    edges: Iterable[Edge], nodes: int, goals: Iterable[int], cost: Callable[[Edge], Cost]
) -> list[Cost | None]:
    """The cost of the cheapest way from each node to a goal, by Dijkstra.

    Args:
        edges: Edges that ways are made of.
        nodes: Number of nodes.
        goals: Indices of the goal nodes.
        cost: Function that gives the cost of an edge, at least 0.

    Returns:
        Cost from each node; None where there is no way.
    """
    into: list[list[tuple[int, Cost]]] = [[] for _ in range(nodes)]
    for edge in edges:
        into[edge.target].append((edge.source, cost(edge)))
    to_go: list[Cost | None] = [None] * nodes
    queue: list[tuple[Cost, int]] = [(0, goal) for goal in sorted(goals)]
    while queue:
        rest, node = heapq.heappop(queue)
        if to_go[node] is not None:
            continue
        to_go[node] = rest
        for source, own in into[node]:
            if to_go[source] is None:
                heapq.heappush(queue, (rest + own, source))
    return to_go
