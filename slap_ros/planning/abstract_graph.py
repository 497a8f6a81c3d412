# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The top level of the abstract planning graph (SLAP §4.1, A.1)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

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


@dataclass
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
        return _leading_to(self.goal_nodes, forward)

    def candidates(self) -> list[tuple[int, int]]:
        """Pairs of nodes, the later one second, that no option joins (SLAP §4.2)."""
        joined = {(edge.source, edge.target) for edge in self.edges}
        count = len(self.nodes)
        return [(i, j) for i in range(count) for j in range(i + 1, count) if (i, j) not in joined]


@dataclass(frozen=True)
class EdgeBeyond:
    """An edge to an abstract state that the graph may not have.

    Args:
        source: Index of a node of the graph.
        abstract: The abstract state that it leads to.
        make_option: Makes the option that leads there, once it is needed.
    """

    source: int
    abstract: int
    make_option: Callable[[], Option]


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


def add_beyond(
    graph: AbstractGraph,
    beyond: Sequence[EdgeBeyond],
    operators: Sequence[tuple[GroundOperator, Option]],
    max_nodes: int = MANY_NODES,
) -> None:
    """Add what lies beyond a graph and is on a way to the goal, with no more edges than it is deep.

    A graph ends where operators first reach the goal. One shortcut changes as much as many
    operators, and so leads to abstract states that are deeper than that: to a goal by a shorter
    way, as where one slap clears a target from which a block was to be taken. Nothing of the graph
    changes, and all that is added comes after it.

    Args:
        graph: To be added to.
        beyond: Edges that may leave it.
        operators: Operators that may follow those edges, each with its option.
        max_nodes: Abstract states, those of the graph included, after which no more are added.
    """
    if beyond:  # else the graph would be copied for nothing
        _Beyond(graph, operators, max_nodes).add(beyond)


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


class _Beyond:
    """One run of :func:`add_beyond`. New nodes have numbers after those of the graph."""

    def __init__(
        self,
        graph: AbstractGraph,
        operators: Sequence[tuple[GroundOperator, Option]],
        max_nodes: int,
    ) -> None:
        self._graph, self._operators, self._max_nodes = graph, operators, max_nodes
        self._old = len(graph.nodes)
        self._nodes, self._depth = list(graph.nodes), list(graph.depth)
        self._index = {abstract: i for i, abstract in enumerate(graph.nodes)}
        self._found: list[tuple[EdgeBeyond, int]] = []  # edges, each with the node it leads to
        self._again: dict[int, int] = {}  # by abstract states, which the graph has as well

    def add(self, beyond: Sequence[EdgeBeyond]) -> None:
        """Layer by layer, as the graph was built; then what leads to no goal is dropped."""
        deepest = self._graph.depth[-1]
        leaving: list[list[EdgeBeyond]] = [[] for _ in range(deepest + 1)]
        for edge in beyond:
            leaving[self._depth[edge.source]].append(edge)
        layer: list[int] = []
        for depth in range(deepest):
            found = [*self._successors(layer), *leaving[depth]]
            reached = [self._follow(edge, depth + 1) for edge in found]
            layer = [node for node in reached if node is not None]
        self._add_useful()

    def _successors(self, layer: Sequence[int]) -> Iterator[EdgeBeyond]:
        for source in layer:
            for operator, option in self._operators:
                if operator.applicable(self._nodes[source]):
                    successor = operator.apply(self._nodes[source])
                    yield EdgeBeyond(source, successor, partial(_made, option))

    def _follow(self, edge: EdgeBeyond, depth: int) -> int | None:
        """Note an edge that leads to a later node; the number of that node if it is new."""
        if self._is_goal(edge.source):
            return None
        index = self._index
        target = index.get(edge.abstract)
        if target is not None and self._leads_on(target, edge.source, depth):
            # Forward edges lead to later nodes. So where the way beyond comes back to the graph, as
            # at goals, a node is there once more, after all of them.
            index = self._again
            target = index.get(edge.abstract)
        new = target is None
        if target is None:
            if len(self._nodes) >= self._max_nodes:
                return None
            target = index[edge.abstract] = len(self._nodes)
            self._nodes.append(edge.abstract)
            self._depth.append(depth)
        if target >= self._old and target > edge.source:
            self._found.append((edge, target))
        return target if new else None

    def _leads_on(self, target: int, source: int, depth: int) -> bool:
        """Whether a way beyond comes back to a node from which it can still end in a goal."""
        rejoins = target < self._old <= source
        return rejoins and (self._is_goal(target) or depth <= self._depth[target])

    def _add_useful(self) -> None:
        """Add the nodes from which a goal can be reached, and the edges to them."""
        goals = [i for i in range(self._old, len(self._nodes)) if self._is_goal(i)]
        useful = _leading_to(goals, [(edge.source, target) for edge, target in self._found])
        kept = sorted(node for node in useful if node >= self._old)
        number = {node: i for i, node in enumerate(kept, self._old)}
        self._graph.nodes += [self._nodes[node] for node in kept]
        self._graph.depth += [self._depth[node] for node in kept]
        self._graph.edges += [
            Edge(number.get(edge.source, edge.source), number[target], edge.make_option())
            for edge, target in self._found
            if target in number
        ]

    def _is_goal(self, node: int) -> bool:
        return self._nodes[node] & self._graph.goal == self._graph.goal


def _made(option: Option) -> Option:
    return option


def _leading_to(goals: Iterable[int], forward: Iterable[tuple[int, int]]) -> set[int]:
    """The nodes from which forward edges, source and target each, lead to a goal; goals as well."""
    found = set(goals)
    for source, target in sorted(forward, reverse=True):
        if target in found:
            found.add(source)
    return found
