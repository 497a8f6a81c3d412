# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The top level of the abstract planning graph (SLAP §4.1, A.1)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.hmax import HMaxHeuristic
from slap_ros.planning.options import Option
from slap_ros.relational import AtomSpace, GroundOperator

MAX_NODES = 200_000  # abstract states after which the top level is given up
MANY_NODES = 20_000  # abstract states after which those too far from the goal are pruned


@dataclass(frozen=True)
class Edge:
    """An option that leads from one node to another; nodes are indices into the graph."""

    source: int
    target: int
    option: Option


@dataclass(repr=False)
class AbstractGraph(ShownInNotebooks):
    """Abstract states in order of discovery, and the options between them.

    Search follows *forward* edges only, those to a node discovered later. The others lead back
    to where a shorter option sequence arrives as well; without them every path is finite.
    """

    goal: int  # mask
    nodes: list[int] = field(default_factory=list)  # abstract states
    depth: list[int] = field(default_factory=list)  # operators from the start
    edges: list[Edge] = field(default_factory=list)
    # The atoms that masks stand for, to name and draw them; None where nobody has said.
    space: AtomSpace | None = field(default=None, repr=False, compare=False)

    def __str__(self) -> str:
        """How large it is."""
        return f"{len(self.nodes)} abstract states, {len(self.edges)} edges"

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

    def on_way_to_goal(self) -> set[int]:
        """Indices of the nodes from which forward edges lead to a goal, goals included."""
        forward = [(e.source, e.target) for e in self.edges if e.target > e.source]
        return leading_to(self.goal_nodes, forward)

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

    Every goal state of that depth is kept. Goal states are not expanded. Where abstract states
    become many, as six blocks can be stacked in so many ways, those are left out from which the
    goal is surely too far away to be reached by that depth.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold.
        operators: Ground operators, each with the option that carries it out.
        extra_depth: How many layers to add after the first with a goal state.
        max_nodes: Abstract states after which to give up.

    Returns:
        The graph, with a goal node at least.

    Raises:
        UnsolvableError: The goal holds in no reachable abstract state.
        PlanningLimitError: More than ``max_nodes`` abstract states.
    """
    try:
        search = _BreadthFirstSearch(goal, operators, min(max_nodes, MANY_NODES))
        return _require_goal(search.run(start, extra_depth))
    except PlanningLimitError:
        if max_nodes <= MANY_NODES:
            raise
    return _build_pruned(start, goal, operators, extra_depth, max_nodes)


def build_unrolled_graph(
    start: int,
    goal: int,
    operators: Sequence[tuple[GroundOperator, Option]],
    length: int,
    max_nodes: int = MANY_NODES,
) -> AbstractGraph:
    """Every sequence of at most so many ground operators, those that come back included.

    An abstract state is a node for each number of operators after which it is reached. So all edges
    are forward edges, and a path may lead through an abstract state twice, in two low-level states.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold; goal states are not expanded.
        operators: Ground operators, each with the option that carries it out.
        length: Operators of the longest sequence.
        max_nodes: Nodes after which to give up.

    Returns:
        The graph, with a goal node at least.

    Raises:
        UnsolvableError: The goal holds after no such sequence.
        PlanningLimitError: More than ``max_nodes`` nodes.
    """
    graph = AbstractGraph(goal, [start], [0])
    layer = {start: 0}
    for depth in range(1, length + 1):
        following: dict[int, int] = {}
        for abstract, source in layer.items():
            if abstract & goal == goal:
                continue
            for operator, option in operators:
                successor = operator.apply(abstract)
                if not operator.applicable(abstract) or successor == abstract:
                    continue
                if successor not in following:
                    following[successor] = len(graph.nodes)
                    graph.nodes.append(successor)
                    graph.depth.append(depth)
                graph.edges.append(Edge(source, following[successor], option))
        if len(graph.nodes) > max_nodes:
            raise PlanningLimitError(
                f"more than {max_nodes} abstract states in sequences of {length} operators"
            )
        layer = following
    return _require_goal(graph)


def _build_pruned(
    start: int,
    goal: int,
    operators: Sequence[tuple[GroundOperator, Option]],
    extra_depth: int,
    max_nodes: int,
) -> AbstractGraph:
    """Only what may be on a way to the goal of so many operators, and of one more each time."""
    heuristic = HMaxHeuristic(goal, [operator for operator, _ in operators])
    length = heuristic(start) or 0
    while True:
        search = _BreadthFirstSearch(goal, operators, max_nodes, heuristic, length)
        graph = search.run(start, 0)
        if graph.goal_nodes and extra_depth:
            length += extra_depth
            search = _BreadthFirstSearch(goal, operators, max_nodes, heuristic, length)
            return search.run(start, extra_depth)
        if graph.goal_nodes or not search.pruned:
            return _require_goal(graph)
        length += 1


def _require_goal(graph: AbstractGraph) -> AbstractGraph:
    if not graph.goal_nodes:
        raise UnsolvableError(
            f"the goal holds in none of the {len(graph.nodes)} abstract states that the "
            "operators can reach"
        )
    return graph


class _BreadthFirstSearch:
    """Builds a graph layer by layer."""

    def __init__(
        self,
        goal: int,
        operators: Sequence[tuple[GroundOperator, Option]],
        max_nodes: int,
        heuristic: HMaxHeuristic | None = None,
        length: int = 0,
    ) -> None:
        """Prepare a search.

        Args:
            goal: Mask of atoms that must hold.
            operators: Ground operators, each with the option that carries it out.
            max_nodes: Abstract states after which to give up.
            heuristic: With one, abstract states are pruned that are on no plan of ``length``
                operators.
            length: See ``heuristic``.
        """
        self._goal, self._max_nodes = goal, max_nodes
        self._masks = [  # calls of operators, in each abstract state, took most of the time
            (ground.preconditions, ground.delete_effects, ground.add_effects, option)
            for ground, option in operators
        ]
        self._heuristic, self._length = heuristic, length
        self.pruned = False  # whether anything was

    def run(self, start: int, extra_depth: int) -> AbstractGraph:
        """Until ``extra_depth`` layers after the first with a goal state, or no more states."""
        graph = AbstractGraph(self._goal, [start], [0])
        index = {start: 0}
        layer, last = [0], None
        while layer:
            depth = graph.depth[layer[0]]
            if last is None and any(self._is_goal(graph.nodes[i]) for i in layer):
                last = depth + extra_depth
            if depth == last:
                break
            layer = self._expand(graph, index, layer)
            if len(graph.nodes) > self._max_nodes:
                raise PlanningLimitError(
                    f"more than {self._max_nodes} abstract states without reaching the goal; "
                    "raise the limit or give a goal nearer by"
                )
        return graph

    def _expand(self, graph: AbstractGraph, index: dict[int, int], layer: list[int]) -> list[int]:
        """Add the successors of a layer; the nodes that are new are the next one."""
        following = []
        for source in layer:
            abstract, depth = graph.nodes[source], graph.depth[source] + 1
            if self._is_goal(abstract):
                continue
            for required, deleted, added, option in self._masks:
                if abstract & required != required:
                    continue
                successor = abstract & ~deleted | added
                if successor == abstract:
                    continue
                if successor not in index:
                    if not self._may_be_on_plan(successor, depth):
                        continue
                    index[successor] = len(graph.nodes)
                    following.append(len(graph.nodes))
                    graph.nodes.append(successor)
                    graph.depth.append(depth)
                graph.edges.append(Edge(source, index[successor], option))
        return following

    def _is_goal(self, abstract: int) -> bool:
        return abstract & self._goal == self._goal

    def _may_be_on_plan(self, abstract: int, depth: int) -> bool:
        if self._heuristic is None:
            return True
        to_go = self._heuristic(abstract)
        near = to_go is not None and depth + to_go <= self._length
        self.pruned |= not near and to_go is not None
        return near


def leading_to(goals: Iterable[int], forward: Iterable[tuple[int, int]]) -> set[int]:
    """The nodes from which forward edges lead to a goal; goals as well.

    Args:
        goals: Indices of goal nodes.
        forward: Source and target of each forward edge.
    """
    found = set(goals)
    for source, target in sorted(forward, reverse=True):
        if target in found:
            found.add(source)
    return found
