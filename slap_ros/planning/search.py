# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortest paths through the abstract graph when edge costs depend on the path (SLAP §4.1, A.1).

What an option costs depends on the low-level state that it starts from, hence on the path so
far. Vertices of the search are therefore (node, low-level state) pairs, and a node is expanded
again for each low-level state in which it is reached.

:func:`search_exhaustively` rolls out every forward edge from every such vertex first and runs
Dijkstra's algorithm on the result, as the paper does. Lazy search
(:mod:`slap_ros.planning.lazy_search`) is A* with lazy edge evaluation; see LazySP (Dellin and
Srinivasa: A unifying formalism for shortest path problems with expensive edge evaluations via lazy
best-first search over paths with edge selectors, ICAPS 2016) for the family: an edge is rolled out
only when it comes to the front of the queue, and until then counts with a lower bound.

Both find the same cost *if bounds are admissible* (no option takes fewer steps than
``Skill.least_steps`` and ``Skill.lower_bound`` say) and no shortcut is given up on the way, which
depends on the order of roll-outs. Tests check the bounds of given skills. The bound of a shortcut,
half of its shortest success in training, is an assumption. Where a roll-out takes less, the lazy
search may return a plan that is longer than the cheapest: by no more than the bounds exceed the
steps along the cheapest path. With the shipped libraries that never happened in 102 states of 80
tasks of the four domains (``python -m benchmarks.shortcut_bounds``). In four of them, of Obstacle
2D, a roll-out was shorter than the shortest success in training: by a quarter at most.

In the planner's model, a plan with shortcuts is never longer than one without when both searches
end with a plan in the same graph and the bounds of the given skills are admissible: shortcuts only
add edges, and their own bounds, right or wrong, never raise the estimate of a path without them.
Executing a plan is another matter: in a world that is not the model it may diverge, and is then
replaced.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import count

from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.failures import Failures
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.relational import State

VertexKey = tuple[int, bytes]


@dataclass(frozen=True)
class Vertex:
    """A node reached in a low-level state.

    Args:
        node: Index of the abstract state, whose atoms hold; where options are not exact, so may
            others.
        state: The low-level state.
        g: Environment steps from the start.
        parent: The vertex before it; None at the start.
        edge: From the parent's node to this one; None at the start.
    """

    node: int
    state: State
    g: int
    parent: Vertex | None = None
    edge: Edge | None = None

    @property
    def key(self) -> VertexKey:
        """Vertices with equal keys have equal futures."""
        return self.node, self.state.key

    def nodes(self) -> Iterator[int]:
        """The nodes of the path to it, from its own back to the start."""
        vertex: Vertex | None = self
        while vertex is not None:
            yield vertex.node
            vertex = vertex.parent


@dataclass(frozen=True)
class FailedPath:
    """A path whose last edge fails in the model.

    Args:
        plan: Edges of the path, with the steps that they take; for the last edge, until it fails.
        node: Index of the node that the last edge should have led to.
        abstract: The abstract state in which it ends instead.
    """

    plan: Plan
    node: int
    abstract: int


@dataclass(frozen=True)
class SearchOutcome:
    """What a search came to.

    Args:
        plan: The plan; None where no path of the graph can be executed.
        failed: Without a plan: paths on which a given or acquired skill moved the robot and failed,
            in the order in which the search met them.
        reason: Without a plan: why there is none.
        at_least: Environment steps that every plan through the graph takes, as far as is proven;
            None where nothing is known.
        stopped: Whether a limit ended the search.
    """

    plan: Plan | None
    failed: tuple[FailedPath, ...] = ()
    reason: str = ""
    at_least: int | None = None
    stopped: bool = False


@dataclass
class LowLevelGraph:
    """The bottom level: every way in which the forward edges can be executed from the start.

    Args:
        start: The vertex to start from.
        successors: Successors of each vertex: edge, environment steps, and the vertex reached,
            whose own cost is not used.
        failures: What was tried, and what of it failed.
    """

    start: Vertex
    successors: dict[VertexKey, list[tuple[Edge, int, Vertex]]] = field(default_factory=dict)
    failures: Failures = field(default_factory=Failures)


def build_bottom_level(graph: AbstractGraph, state: State, model: Model) -> LowLevelGraph:
    """Roll out every forward edge from every low-level state in which its source is reached.

    Nodes are taken in order of discovery, which forward edges follow, so that each node's
    low-level states are complete when its turn comes.

    Args:
        graph: The top level.
        state: The low-level state to start from, in the graph's first node.
        model: Rolls options out.

    Returns:
        The bottom level.
    """
    bottom = LowLevelGraph(Vertex(0, state, 0))
    forward, goals = graph.forward_edges(), set(graph.goal_nodes)
    reached: list[dict[VertexKey, Vertex]] = [{} for _ in graph.nodes]
    reached[0][bottom.start.key] = bottom.start
    for node, vertices in enumerate(reached):
        if node in goals:
            continue
        for vertex in vertices.values():
            found = bottom.successors.setdefault(vertex.key, [])
            for each in forward[node]:
                for edge, rollout in _attempts(each, vertex.state, graph, model, bottom.failures):
                    successor = Vertex(edge.target, rollout.final, 0)
                    reached[edge.target].setdefault(successor.key, successor)
                    found.append((edge, rollout.steps, successor))
    return bottom


def _attempts(
    edge: Edge, state: State, graph: AbstractGraph, model: Model, failures: Failures
) -> Iterator[tuple[Edge, Rollout]]:
    """All rollouts of an edge's option that reach its target, the shortest first."""
    option: Option | None = edge.option
    while option is not None:
        target = option.target(graph.nodes[edge.target])
        rollout = model.roll_out(option, state, target)
        if option.attempt == edge.option.attempt:
            failures.add(option, target, rollout)
        if not rollout.reached:
            return
        yield replace(edge, option=option), rollout
        option = option.next_attempt()


def search_exhaustively(graph: AbstractGraph, state: State, model: Model) -> SearchOutcome:
    """Build the whole bottom level, then Dijkstra; stop when the best goal vertex is closed.

    Args:
        graph: The top level.
        state: The low-level state to start from, in the graph's first node.
        model: Rolls options out.

    Returns:
        A plan of least cost, if any path of the graph can be executed from ``state``.
    """
    bottom, goals = build_bottom_level(graph, state, model), set(graph.goal_nodes)
    tie = count()
    queue = [(0, next(tie), bottom.start)]
    closed: dict[VertexKey, Vertex] = {}
    while queue:
        g, _, vertex = heapq.heappop(queue)
        if vertex.node in goals:
            return SearchOutcome(plan_to(graph, vertex), at_least=g)
        if vertex.key in closed:
            continue
        closed[vertex.key] = vertex
        for edge, steps, successor in bottom.successors[vertex.key]:
            reached = Vertex(successor.node, successor.state, g + steps, vertex, edge)
            heapq.heappush(queue, (reached.g, next(tie), reached))
    failed = _failed_edges(graph, closed.values(), model)
    return without_plan(graph, failed, model, bottom.failures)


def _failed_edges(
    graph: AbstractGraph, vertices: Iterable[Vertex], model: Model
) -> Iterator[Vertex]:
    """Where operators that failed have left the robot; the model has rolled all of them out."""
    forward = graph.forward_edges()
    for vertex in vertices:
        for edge in forward[vertex.node]:
            target = edge.option.target(graph.nodes[edge.target])
            rollout = model.roll_out(edge.option, vertex.state, target)
            if rollout.moved_and_failed and edge.option.kind is OptionKind.OPERATOR:
                yield Vertex(edge.target, rollout.final, vertex.g + rollout.steps, vertex, edge)


def plan_to(graph: AbstractGraph, goal: Vertex) -> Plan:
    """The plan whose edges lead to a vertex.

    Args:
        graph: The top level.
        goal: Where the plan ends.
    """
    edges = [
        PlanEdge(
            edge.option,
            edge.option.target(graph.nodes[edge.target]),
            vertex.g - parent.g,
        )
        for vertex, parent, edge in _path(goal)
    ]
    return Plan(tuple(reversed(edges)))


def _path(vertex: Vertex) -> Iterator[tuple[Vertex, Vertex, Edge]]:
    while vertex.parent is not None and vertex.edge is not None:
        yield vertex, vertex.parent, vertex.edge
        vertex = vertex.parent


def without_plan(
    graph: AbstractGraph, failed: Iterable[Vertex], model: Model, failures: Failures
) -> SearchOutcome:
    """The outcome of a search that found no plan.

    Args:
        graph: The top level.
        failed: Where operators that failed have left the robot, in order.
        model: Model that rolled the options out.
        failures: Options that were tried.
    """
    what = f"no path through the {len(graph.nodes)} abstract states can be executed from here"
    why = failures.in_words()
    paths = tuple(
        FailedPath(plan_to(graph, ended), ended.node, model.space.abstract(ended.state))
        for ended in failed
    )
    return SearchOutcome(None, paths, f"{what}: {why}" if why else what)
