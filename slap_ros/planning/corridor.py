# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract graph near a plan, for problems whose whole graph is too large to be made.

It has the abstract states of the plan, what the operators that FF calls helpful lead to from them,
and from each of these a way to the goal that the FF heuristic finds. Shortcuts join what is on one
way: what takes many operators, one after the other, is what they were learned for. A plan through
this graph may be far shorter than the one that it was made around; the next graph is then made
around the new one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.ff import FFHeuristic, find_operator_sequence
from slap_ros.planning.options import Option
from slap_ros.planning.problem import GroundedOptions
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.relational import GroundOperator

MAX_EXPANSIONS = 2_000  # abstract states, to find one way to the goal
MOST_DETOURS = 20  # helpful operators, the first along a plan, after which a way is looked for

Step = tuple[int, Option, int]  # abstract state, what is done there, and where it leads


class Corridor(AbstractGraph):
    """An abstract graph in which search may follow every edge."""

    def forward_edges(self) -> list[list[Edge]]:
        """All edges, by source node."""
        outgoing: list[list[Edge]] = [[] for _ in self.nodes]
        for edge in self.edges:
            outgoing[edge.source].append(edge)
        return outgoing


@dataclass
class CorridorBuilder:
    """Makes corridors of one problem; ways to the goal are kept from one to the next.

    Args:
        goal: Mask of atoms that must hold.
        options: Ground operators, each with the option that carries it out.
        shortcuts: Where shortcut edges come from; None for pure planning.
    """

    goal: int
    options: GroundedOptions
    shortcuts: ShortcutSource | None
    _ways: dict[int, tuple[Step, ...] | None] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self._operators: list[GroundOperator] = [operator for operator, _ in self.options]
        self._heuristic = FFHeuristic(self.goal, self._operators)

    def around(self, route: Sequence[int]) -> Corridor:
        """The graph near some abstract states.

        Args:
            route: Abstract states, masks; the first is the one to start from.
        """
        steps: dict[Step, None] = {}  # ordered, each once
        detours = MOST_DETOURS
        for source in route:
            steps.update(dict.fromkeys(self._steps_from(source)))
            for first in self._helpful_steps(source):
                if first[2] not in self._ways:
                    if not detours:
                        break
                    detours -= 1
                steps[first] = None
                steps.update(dict.fromkeys(self._steps_from(first[2])))
        return _graph_of(route[0], self.goal, steps)

    def _helpful_steps(self, source: int) -> Iterator[Step]:
        helpful = self._heuristic.helpful_atoms(source)
        for operator, option in self.options:
            if operator.add_effects & helpful and operator.applicable(source):
                yield source, option, operator.apply(source)

    def _steps_from(self, source: int) -> Iterator[Step]:
        """The way to the goal, the shortcuts along it, and the ways to the goal behind those."""
        way = self._way(source)
        if way is None:
            return
        yield from way
        for skip in self._skips(source, way):
            yield skip
            yield from self._way(skip[2]) or ()

    def _skips(self, source: int, way: Sequence[Step]) -> Iterator[Step]:
        """The shortcuts between states on the way, and from the source to states beyond."""
        if self.shortcuts is None or not way:
            return
        nodes = list(dict.fromkeys([source, *(step[2] for step in way)]))
        line = AbstractGraph(self.goal, nodes, list(range(len(nodes))))
        line.edges.append(Edge(0, 1, way[0][1]))
        edges = self.shortcuts.edges(line)
        for edge in edges:
            yield nodes[edge.source], edge.option, nodes[edge.target]
        within = {edge.option.skill.name for edge in edges}
        for beyond in self.shortcuts.beyond(AbstractGraph(self.goal, [source], [0]), within):
            yield source, beyond.make_option(), beyond.abstract

    def _way(self, source: int) -> tuple[Step, ...] | None:
        """Operators from an abstract state to the goal; None where FF finds none soon."""
        if source not in self._ways:
            self._ways[source] = None
            with suppress(UnsolvableError, PlanningLimitError):
                self._ways[source] = tuple(self._find_way(source))
        return self._ways[source]

    def _find_way(self, abstract: int) -> Iterator[Step]:
        sequence = find_operator_sequence(
            abstract, self.goal, self._operators, max_expansions=MAX_EXPANSIONS
        )
        for index in sequence:
            operator, option = self.options[index]
            before, abstract = abstract, operator.apply(abstract)
            yield before, option, abstract


def _graph_of(start: int, goal: int, steps: Iterable[Step]) -> Corridor:
    """The graph with these steps as edges, and the start as its first node."""
    index = {start: 0}
    graph = Corridor(goal, [start], [0])
    for source, option, target in steps:
        for abstract in (source, target):
            if abstract not in index:
                index[abstract] = len(graph.nodes)
                graph.nodes.append(abstract)
                graph.depth.append(0)
        if source & goal != goal:
            graph.edges.append(Edge(index[source], index[target], option))
    return graph
