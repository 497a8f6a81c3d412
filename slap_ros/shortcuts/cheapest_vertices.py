# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a task's graph that are cheapest to reach, each in the state it is reached in."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import count

from slap_ros.core import Task
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.model import Model
from slap_ros.planning.plan import Plan
from slap_ros.planning.search import Vertex


class CheapestVertices:
    """Executes options in the model, from the start of a task on."""

    def __init__(self, task: Task, graph: AbstractGraph, model: Model) -> None:
        """Execute nothing yet.

        Args:
            task: Task in whose initial state everything begins.
            graph: Abstract planning graph of the task.
            model: Model in which options are executed.
        """
        self._start = Vertex(0, task.initial_state, 0)
        self._graph, self._model = graph, model
        self._forward = graph.forward_edges()
        self.steps = 0  # environment steps so far

    def __iter__(self) -> Iterator[Vertex]:
        """Yield each node once, in the state in which it is reached first (Dijkstra)."""
        goals = set(self._graph.goal_nodes)
        tie = count()
        queue = [(0, next(tie), self._start)]
        closed: set[int] = set()
        while queue:
            _, _, vertex = heapq.heappop(queue)
            if vertex.node in closed:
                continue
            closed.add(vertex.node)
            yield vertex
            for edge in self._forward[vertex.node] if vertex.node not in goals else []:
                reached = self._follow(vertex, edge)
                if reached is not None:
                    heapq.heappush(queue, (reached.g, next(tie), reached))

    def along(self, plan: Plan, besides: Collection[int]) -> list[Vertex]:
        """The vertices that a plan leads to.

        Args:
            plan: Plan of the task.
            besides: Indices of nodes whose vertices are left out.
        """
        at, found = self._start, []
        for option in (planned.option for planned in plan.edges):
            same = (e for e in self._forward[at.node] if str(e.option) == str(option))
            ways = (self._follow(at, replace(e, option=option)) for e in same)  # in that attempt
            following = next((way for way in ways if way is not None), None)
            if following is None:
                break
            at = following
            if at.node not in besides:
                found.append(at)
        return found

    def _follow(self, vertex: Vertex, edge: Edge) -> Vertex | None:
        """The vertex that an edge leads to from another; None where it cannot be executed."""
        target = edge.option.target(self._graph.nodes[edge.target])
        rollout = self._model.roll_out(edge.option, vertex.state, target)
        self.steps += rollout.steps
        if not rollout.reached:
            return None
        return Vertex(edge.target, rollout.final, vertex.g + rollout.steps, vertex, edge)
