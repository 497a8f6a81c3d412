# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which shortcut would do what rollouts did, and how many steps it is expected to save.

What a shortcut from node i to node j can save is the cost of the best plan less the costs of the
way to i, of the shortcut, and of the way on from j. The way on is estimated with the mean cost of
each operator.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.search import Vertex
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace
from slap_ros.shortcuts.exploration_rollouts import RolloutHits
from slap_ros.shortcuts.rollout_origins import RolloutOrigin
from slap_ros.shortcuts.shortcut_candidate import OperatorPath, ShortcutCandidate
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.way_on import WayOn, steps_to_goal

ABSORBED_MOTION = 0.5  # share of a motion's steps that remain where it is part of a shortcut


@dataclass(frozen=True)
class Destination:
    """Where a shortcut would lead.

    Args:
        node: Abstract state, a mask.
        to_go: Estimated environment steps from there to a goal.
        beyond: Whether the abstract planning graph does not have it.
    """

    node: int
    to_go: float
    beyond: bool = False


class CandidateValuation:
    """Values what rollouts reached in one task."""

    def __init__(
        self,
        domain: Domain,
        space: AtomSpace,
        graph: AbstractGraph,
        plan_steps: int,
        operator_steps: Mapping[str, float],
        way_on: WayOn | None,
    ) -> None:
        """Estimate the way on from each node.

        Args:
            domain: Domain of the task.
            space: Atoms of the task.
            graph: Abstract planning graph of the task.
            plan_steps: Environment steps of the plan that shortcuts are to shorten.
            operator_steps: Mean environment steps of each operator, by name.
            way_on: Measures the way on from abstract states that the graph does not have; None
                where no shortcut may lead to one.
        """
        self._space, self._graph, self._plan_steps = space, graph, plan_steps
        self._operator_steps, self._way_on = operator_steps, way_on
        interface = learner_interface(domain)
        self._grasping = interface.grasping
        self._grasp_atoms = interface.grasp_atoms(self._space)
        nodes = graph.nodes
        self._joined = {(nodes[edge.source], nodes[edge.target]) for edge in graph.edges}
        self._to_go = steps_to_goal(graph, operator_steps)
        self._indexed: tuple[Vertex, Mapping[int, int]] | None = None  # of the latest vertex

    def is_useful(self, vertex: Vertex, target: int) -> bool:
        """Whether a shortcut of no steps, from a vertex to a node, would be new and shorten plans.

        Args:
            vertex: Vertex in which the shortcut begins.
            target: Index of the node that it leads to.
        """
        nodes = self._graph.nodes
        saves = vertex.g + self._to_go[target] < self._plan_steps
        return saves and (nodes[vertex.node], nodes[target]) not in self._joined

    def destination(self, node: int) -> Destination:
        """A node of the graph as the destination of a shortcut.

        Args:
            node: Index of the node.
        """
        return Destination(self._graph.nodes[node], self._to_go[node])

    def destination_of(
        self, vertex: Vertex, abstract: int, hits: RolloutHits, budget: float
    ) -> Destination | None:
        """Where a shortcut would lead that does what rollouts did; None where it is of no use.

        Where more atoms hold in the vertex than in its node, they have to stay.

        Args:
            vertex: Vertex of the rollouts' origin.
            abstract: Abstract state that the rollouts reached, a mask.
            hits: Rollouts that reached it.
            budget: Environment steps that may be taken to see what it takes from there to a goal.
        """
        nodes = self._graph.nodes
        within = self._index_after(vertex).get(abstract)
        if within is not None:
            return self.destination(within) if within > vertex.node else None
        before = self._space.abstract(vertex.state)
        target = Change.between(before, abstract).apply(nodes[vertex.node])
        if self._way_on is None or target in nodes:
            return None
        to_go = self._way_on.measure(hits.shortest, target, self._operator_steps, budget)
        return Destination(target, to_go, beyond=True)

    def _index_after(self, vertex: Vertex) -> Mapping[int, int]:
        """The nodes by the abstract states that are reached in them from a vertex."""
        if self._indexed is None or self._indexed[0] is not vertex:
            abstract, node = self._space.abstract(vertex.state), self._graph.nodes[vertex.node]
            index = {
                Change.between(node, target).apply(abstract): j
                for j, target in enumerate(self._graph.nodes)
            }
            self._indexed = vertex, index
        return self._indexed[1]

    def candidates(
        self, origin: RolloutOrigin, destination: Destination, hits: RolloutHits
    ) -> Iterator[ShortcutCandidate]:
        """Yield the candidates from wherever a shortcut to a destination may begin.

        Args:
            origin: Origin of the rollouts.
            destination: Destination that the rollouts reached.
            hits: Rollouts that reached it.

        Yields:
            Candidates, some of whose expected savings may be negative.
        """
        for source in self._sources(origin.vertex):
            if (self._graph.nodes[source.node], destination.node) not in self._joined:
                yield self.candidate(source, origin, destination, hits)

    def _sources(self, vertex: Vertex) -> Iterator[Vertex]:
        """Yield the vertices where a shortcut may begin that does what rollouts from one did.

        At that vertex, or before the options that led there as far as they change nothing in what
        is held: a shortcut may well learn to move there by itself.
        """
        yield vertex
        while vertex.parent is not None:
            nodes = self._graph.nodes[vertex.parent.node], self._graph.nodes[vertex.node]
            if (nodes[0] ^ nodes[1]) & self._grasp_atoms:
                return
            vertex = vertex.parent
            yield vertex

    def candidate(
        self, source: Vertex, origin: RolloutOrigin, destination: Destination, hits: RolloutHits
    ) -> ShortcutCandidate:
        """The candidate: a shortcut from ``source`` to what rollouts reached.

        Args:
            source: Vertex in which the shortcut begins: that of the origin, or one before it.
            origin: Origin of the rollouts.
            destination: Destination of the shortcut.
            hits: Rollouts that reached the destination.

        Returns:
            The candidate, whose expected saving may be negative.
        """
        node = self._graph.nodes[source.node]
        motions, steps = origin.g - source.g, hits.least
        expected = source.g + ABSORBED_MOTION * motions + steps
        return ShortcutCandidate(
            Signature.between(node, destination.node, self._space, self._grasping),
            operator_path_to(source),
            len(hits.lengths),
            motions + steps,
            self._plan_steps,
            self._plan_steps - (expected + destination.to_go),
            destination.beyond,
            tuple(hits.found_by),
        )


def operator_path_to(vertex: Vertex) -> OperatorPath:
    """The names of the operators by which a vertex was reached."""
    names: list[str] = []
    at: Vertex | None = vertex
    while at is not None and at.edge is not None:
        names.append(at.edge.option.skill.name)
        at = at.parent
    return tuple(reversed(names))
