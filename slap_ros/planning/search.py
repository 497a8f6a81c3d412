# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortest paths through the abstract graph when edge costs depend on the path (SLAP §4.1, A.1).

What an option costs depends on the low-level state that it starts from, hence on the path so
far. Vertices of the search are therefore (node, low-level state) pairs, and a node is expanded
anew for each low-level state in which it is reached.

:func:`search_exhaustively` rolls out every forward edge from every such vertex first and runs
Dijkstra's algorithm on the result, as the paper does. :func:`search_lazily` rolls out an edge
only when it lies on what is, by admissible lower bounds, the cheapest path. Both find the same
cost.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count

from slap_ros.errors import UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.options import Option
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.relational import State


@dataclass(frozen=True)
class Vertex:
    """A node reached in a low-level state, and how."""

    node: int
    state: State
    cost: int  # environment steps from the start
    parent: Vertex | None = None
    edge: Edge | None = None

    @property
    def key(self) -> tuple[int, bytes]:
        """Vertices with equal keys have equal futures."""
        return self.node, self.state.key


@dataclass
class LowLevelGraph:
    """The bottom level: every way in which the forward edges can be run from the start."""

    start: Vertex
    successors: dict[tuple[int, bytes], list[tuple[Edge, int, Vertex]]] = field(
        default_factory=dict
    )  # of each vertex: edge, steps, and the vertex reached (its cost is not used)


def build_bottom_level(graph: AbstractGraph, state: State, model: Model) -> LowLevelGraph:
    """Roll out every forward edge from every low-level state in which its source is reached.

    Nodes are taken in order of discovery, which forward edges follow, so that each node's
    low-level states are complete when its turn comes.
    """
    bottom = LowLevelGraph(Vertex(0, state, 0))
    forward, goals = graph.forward_edges(), set(graph.goal_nodes)
    reached: list[dict[tuple[int, bytes], Vertex]] = [{} for _ in graph.nodes]
    reached[0][bottom.start.key] = bottom.start
    for node, vertices in enumerate(reached):
        if node in goals:
            continue
        for vertex in vertices.values():
            found = bottom.successors.setdefault(vertex.key, [])
            for each in forward[node]:
                for edge, rollout in _ways(each, vertex.state, graph, model):
                    successor = Vertex(edge.target, rollout.final, 0)
                    reached[edge.target].setdefault(successor.key, successor)
                    found.append((edge, rollout.steps, successor))
    return bottom


def _ways(
    edge: Edge, state: State, graph: AbstractGraph, model: Model
) -> Iterator[tuple[Edge, Rollout]]:
    """All ways in which an edge can be run, the shortest first."""
    option: Option | None = edge.option
    while option is not None:
        rollout = model.roll_out(option, state, graph.nodes[edge.target])
        if not rollout.reached:
            return
        yield replace(edge, option=option), rollout
        option = option.next_attempt()


def search_exhaustively(graph: AbstractGraph, state: State, model: Model) -> Plan:
    """Build the whole bottom level, then Dijkstra; stop when the best goal vertex is closed.

    Raises:
        UnsolvableError: No path of the graph can be executed from ``state``.
    """
    bottom, goals = build_bottom_level(graph, state, model), set(graph.goal_nodes)
    tie = count()
    queue = [(0, next(tie), bottom.start)]
    closed: set[tuple[int, bytes]] = set()
    while queue:
        cost, _, vertex = heapq.heappop(queue)
        if vertex.node in goals:
            return _plan(graph, vertex)
        if vertex.key in closed:
            continue
        closed.add(vertex.key)
        for edge, steps, successor in bottom.successors[vertex.key]:
            reached = Vertex(successor.node, successor.state, cost + steps, vertex, edge)
            heapq.heappush(queue, (reached.cost, next(tie), reached))
    raise _infeasible(graph)


@dataclass(order=True)
class _Waiting:
    """What may be looked at next: a vertex, or an edge out of it that was not rolled out yet."""

    bound: int  # environment steps of any plan through it
    tie: int
    vertex: Vertex = field(compare=False)
    edge: Edge | None = field(compare=False)
    least: int = field(compare=False)  # environment steps that the edge takes

    @property
    def node(self) -> int:
        """Where it leads."""
        return self.vertex.node if self.edge is None else self.edge.target


class _Frontier:
    """What waits, best first by cost so far plus lower bounds of what is to come."""

    def __init__(self, graph: AbstractGraph) -> None:
        self._goals = graph.goal_nodes
        self._keep(graph.forward_edges())
        self._queue: list[_Waiting] = []
        self._tie = count()

    def push(self, vertex: Vertex, edge: Edge | None = None, least: int = 0) -> None:
        """Let something wait, if a goal can be reached through it."""
        # Deeper first among equals: they are nearer to the goal.
        self._put(_Waiting(0, -next(self._tie), vertex, edge, least))

    def _put(self, waiting: _Waiting) -> None:
        rest = self._to_go[waiting.node]
        if rest is not None:
            waiting.bound = waiting.vertex.cost + waiting.least + rest
            heapq.heappush(self._queue, waiting)

    def pop(self) -> _Waiting | None:
        """The best; None if nothing waits."""
        while self._queue:
            best = heapq.heappop(self._queue)
            known = best.bound
            rest = self._to_go[best.node]
            if rest is not None and best.vertex.cost + best.least + rest <= known:
                return best
            self._put(best)  # bounds rose since it was pushed
        return None

    def give_up(self) -> None:
        """Leave out the options that were given up: their bounds promise what they do not keep."""
        self._keep([[e for e in out if not e.option.given_up()] for out in self.forward])

    def _keep(self, forward: list[list[Edge]]) -> None:
        """Look ahead along these edges, and leave out those through which no goal is reached."""
        self._to_go = _steps_to_go(forward, self._goals)
        self.forward = [[e for e in out if self._to_go[e.target] is not None] for out in forward]


def search_lazily(graph: AbstractGraph, state: State, model: Model) -> Plan:
    """Best first, rolling out on demand: an edge when it comes to the front of what waits.

    Until then it counts with the bound of its skill from the state at its source. Bounds never
    exceed the true steps, so the first goal vertex at the front is the cheapest.

    Raises:
        UnsolvableError: No path of the graph can be executed from ``state``.
    """
    frontier, goals = _Frontier(graph), set(graph.goal_nodes)
    start = Vertex(0, state, 0)
    cheapest = {start.key: 0}
    frontier.push(start)
    while (best := frontier.pop()) is not None:
        vertex, edge = best.vertex, best.edge
        if edge is not None and not edge.option.given_up():
            rollout = model.roll_out(edge.option, vertex.state, graph.nodes[edge.target])
            if rollout.reached:
                cost = vertex.cost + rollout.steps
                reached = Vertex(edge.target, rollout.final, cost, vertex, edge)
                if cost < cheapest.get(reached.key, cost + 1):
                    cheapest[reached.key] = cost
                    frontier.push(reached)
                next_attempt = edge.option.next_attempt()
                if next_attempt is not None:  # it takes longer, but what comes next may take less
                    frontier.push(vertex, replace(edge, option=next_attempt), rollout.steps)
            elif edge.option.given_up():
                frontier.give_up()
        elif edge is None and vertex.node in goals:
            return _plan(graph, vertex)
        elif edge is None and vertex.cost == cheapest[vertex.key]:
            for out in frontier.forward[vertex.node]:
                skill = out.option.skill
                bound = skill.lower_bound(vertex.state, out.option.objects)
                frontier.push(vertex, out, max(skill.least_steps, bound))
    raise _infeasible(graph)


def _steps_to_go(forward: list[list[Edge]], goals: Sequence[int]) -> list[int | None]:
    """Lower bound of the steps from each node to a goal; None where there is no way."""
    steps: list[int | None] = [None] * len(forward)
    for goal in goals:
        steps[goal] = 0
    for node in reversed(range(len(forward))):  # forward edges lead to later nodes
        for edge in forward[node]:
            rest = steps[edge.target]
            if rest is not None:
                through = edge.option.skill.least_steps + rest
                known = steps[node]
                steps[node] = through if known is None else min(known, through)
    return steps


def _plan(graph: AbstractGraph, goal: Vertex) -> Plan:
    edges = [
        PlanEdge(edge.option, graph.nodes[edge.target], vertex.cost - parent.cost)
        for vertex, parent, edge in _path(goal)
    ]
    return Plan(tuple(reversed(edges)))


def _path(vertex: Vertex) -> Iterator[tuple[Vertex, Vertex, Edge]]:
    while vertex.parent is not None and vertex.edge is not None:
        yield vertex, vertex.parent, vertex.edge
        vertex = vertex.parent


def _infeasible(graph: AbstractGraph) -> UnsolvableError:
    return UnsolvableError(
        f"no path through the {len(graph.nodes)} abstract states can be executed from here"
    )
