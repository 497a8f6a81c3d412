# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The top level of the abstract planning graph (SLAP §4.1, A.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.options import Option
from slap_ros.relational import GroundOperator

MAX_NODES = 200_000  # abstract states after which the top level is given up


@dataclass(frozen=True)
class Edge:
    """An option that leads from one node to another; nodes are indices into the graph."""

    source: int
    target: int
    option: Option


@dataclass
class AbstractGraph:
    """Abstract states in order of discovery, and the options between them.

    Search follows *forward* edges only, those to a node discovered later. The others lead back
    to where a shorter option sequence arrives as well; without them every path is finite.
    """

    goal: int  # mask
    nodes: list[int] = field(default_factory=list)  # abstract states
    depth: list[int] = field(default_factory=list)  # operators from the start
    edges: list[Edge] = field(default_factory=list)

    @property
    def goal_nodes(self) -> list[int]:
        """Indices of the nodes in which the goal holds."""
        return [i for i, node in enumerate(self.nodes) if node & self.goal == self.goal]

    def forward_edges(self) -> list[list[Edge]]:
        """The edges that search may follow, by source node."""
        outgoing: list[list[Edge]] = [[] for _ in self.nodes]
        for edge in self.edges:
            if edge.target > edge.source:
                outgoing[edge.source].append(edge)
        return outgoing

    def candidates(self) -> list[tuple[int, int]]:
        """Pairs of nodes, the later one second, that no option joins (SLAP §4.2)."""
        joined = {(edge.source, edge.target) for edge in self.edges}
        count = len(self.nodes)
        return [(i, j) for i in range(count) for j in range(i + 1, count) if (i, j) not in joined]


def build_abstract_graph(
    start: int,
    goal: int,
    operators: Sequence[tuple[GroundOperator, Option]],
    extra_depth: int = 0,
    max_nodes: int = MAX_NODES,
) -> AbstractGraph:
    """Breadth-first over ground operators until the depth at which the goal first holds.

    Every goal state of that depth is kept. Goal states are not expanded.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold.
        operators: Ground operators, each with the option that carries it out.
        extra_depth: How many layers to go on after the first with a goal state.
        max_nodes: Abstract states after which to give up.

    Raises:
        UnsolvableError: The goal holds in no reachable abstract state.
        PlanningLimitError: More than ``max_nodes`` abstract states.
    """
    graph = AbstractGraph(goal, [start], [0])
    index = {start: 0}
    layer, last = [0], None
    while layer:
        depth = graph.depth[layer[0]]
        if last is None and any(graph.nodes[i] & goal == goal for i in layer):
            last = depth + extra_depth
        if depth == last:
            return graph
        layer = _expand(graph, index, layer, operators)
        if len(graph.nodes) > max_nodes:
            raise PlanningLimitError(
                f"more than {max_nodes} abstract states without reaching the goal; "
                "raise the limit or give a goal nearer by"
            )
    if last is None:
        raise UnsolvableError(
            f"the goal holds in none of the {len(graph.nodes)} abstract states that the "
            "operators can reach"
        )
    return graph


def _expand(
    graph: AbstractGraph,
    index: dict[int, int],
    layer: list[int],
    operators: Sequence[tuple[GroundOperator, Option]],
) -> list[int]:
    """Add the successors of a layer; the nodes that are new are the next one."""
    following = []
    for source in layer:
        abstract = graph.nodes[source]
        if abstract & graph.goal == graph.goal:
            continue
        for operator, option in operators:
            if not operator.applicable(abstract):
                continue
            successor = operator.apply(abstract)
            if successor == abstract:
                continue
            if successor not in index:
                index[successor] = len(graph.nodes)
                following.append(len(graph.nodes))
                graph.nodes.append(successor)
                graph.depth.append(graph.depth[source] + 1)
            graph.edges.append(Edge(source, index[successor], option))
    return following
