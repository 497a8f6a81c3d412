# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What lies beyond an abstract graph: abstract states that only shortcuts lead to."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Self

from slap_ros.planning.abstract_graph import MANY_NODES, AbstractGraph, Edge, leading_to
from slap_ros.planning.options import Option
from slap_ros.relational import GroundOperator


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

    @classmethod
    def of(cls, source: int, abstract: int, option: Option) -> Self:
        """An edge whose option is made already.

        Args:
            source: Index of a node of the graph.
            abstract: The abstract state that it leads to.
            option: The option that leads there.
        """
        return cls(source, abstract, lambda: option)


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
                    yield EdgeBeyond.of(source, successor, option)

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
        useful = leading_to(goals, [(edge.source, target) for edge, target in self._found])
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
