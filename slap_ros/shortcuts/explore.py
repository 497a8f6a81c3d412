# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collect and prune: which shortcuts are worth learning (SLAP §4.2, Alg. 1).

The paper records the low-level states of a whole abstract graph and makes random rollouts from
all of them. What a shortcut from i to j can save, though, is what the best plan costs less the
way to i, the shortcut, and the way on from j. So nodes are explored in the order in which they
can be reached, and what is known of the rest of the way is what operators cost on average.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.planner import GraphPlanner, Problem
from slap_ros.planning.search import Vertex
from slap_ros.relational import State
from slap_ros.shortcuts.action_map import ActionMap
from slap_ros.shortcuts.settings import Exploration
from slap_ros.shortcuts.sight import learner_interface
from slap_ros.shortcuts.signature import Change, Signature, context_of

Origin = tuple[str, ...]  # operators by which a shortcut's source was reached
MERGED = 0.5  # of a motion's steps that are left where it is part of a shortcut
ONE_BY_ONE = 4  # worlds that cannot be stepped together
GRIPPER_CHOICES = np.array([0.0, 0.0, 0.0, 1.0, -1.0])  # in every second rollout


@dataclass(frozen=True)
class Find:
    """A candidate that random rollouts reached.

    Args:
        signature: What it changes.
        origin: Where from.
        hits: In how many rollouts.
        steps: Of the shortest of them, and of what led there from where the shortcut begins.
        plan_steps: Of the plan without it.
        promise: Environment steps by which it would shorten the plan.
    """

    signature: Signature
    origin: Origin
    hits: int
    steps: int
    plan_steps: int
    promise: float

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **{field.name: getattr(self, field.name) for field in fields(self)},
            "signature": self.signature.as_json(),
            "origin": list(self.origin),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Find:
        """The find of :meth:`as_json`."""
        numbers = {name: data[name] for name in ("hits", "steps", "plan_steps", "promise")}
        if not all(isinstance(value, int | float) for value in numbers.values()):
            raise TypeError(f"{numbers} are not all numbers")
        origin = tuple(str(name) for name in data["origin"])
        return cls(Signature.from_json(data["signature"]), origin, **numbers)


@dataclass(frozen=True)
class Explored:
    """What exploring one task came to."""

    finds: tuple[Find, ...]
    candidates: int  # pairs of abstract states that no option joins
    environment_steps: int
    operator_steps: Mapping[str, float]  # mean of each operator

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **{field.name: getattr(self, field.name) for field in fields(self)},
            "finds": [find.as_json() for find in self.finds],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Explored:
        """What :meth:`as_json` wrote."""
        return cls(
            tuple(Find.from_json(find) for find in data["finds"]),
            int(data["candidates"]),
            int(data["environment_steps"]),
            {str(name): float(mean) for name, mean in data["operator_steps"].items()},
        )


class Explorer:
    """Explores one task."""

    def __init__(
        self, domain: Domain, seed: int, index: int, settings: Exploration, rng: np.random.Generator
    ) -> None:
        self.task = domain.task(seed, index)
        self._domain, self._settings, self._rng = domain, settings, rng
        self._problem = Problem.of(domain, self.task.initial_state)
        self.space = self._problem.model.space
        self._grasping = self.space.mask(
            atom
            for atom in self.space.atoms
            if atom.predicate in learner_interface(domain).grasping
        )
        goal = self.space.mask(self.task.goal)
        self._plan = GraphPlanner(self._problem).plan(self.task.initial_state, goal).plan
        self.graph = build_abstract_graph(
            self.space.abstract(self.task.initial_state), goal, self._problem.operators
        )
        worlds = settings.rollouts if domain.steps_together else ONE_BY_ONE
        self._worlds = domain.make_vector_world([self.task.initial_state] * worlds)
        self._gripper = np.arange(worlds) % 2 == 1
        self._steps = 0

    def explore(self) -> Explored:
        """Collect states, roll out from them, value what was reached."""
        vertices, operator_steps = self._collect()
        to_go = ways_to_goal(self.graph, operator_steps)
        index = {node: j for j, node in enumerate(self.graph.nodes)}
        joined = {(edge.source, edge.target) for edge in self.graph.edges}
        finds = []
        for vertex in vertices:
            for j, lengths in self._roll_out(vertex, index).items():
                if len(lengths) < self._settings.hits:
                    continue
                finds += [
                    self._value(beginning, vertex, j, lengths, to_go[j])
                    for beginning in self._beginnings(vertex)
                    if (beginning.node, j) not in joined
                ]
        return Explored(
            tuple(find for find in finds if find.promise > 0.0),
            len(self.graph.candidates()),
            self._steps,
            operator_steps,
        )

    def _beginnings(self, vertex: Vertex) -> Iterator[Vertex]:
        """Where a shortcut may begin that does what was found from a vertex.

        There, or before the motions of the empty or full hand that led there: what they are good
        for a shortcut may well do on its way.
        """
        yield vertex
        while vertex.parent is not None:
            nodes = self.graph.nodes[vertex.parent.node], self.graph.nodes[vertex.node]
            if (nodes[0] ^ nodes[1]) & self._grasping:
                return
            vertex = vertex.parent
            yield vertex

    def _value(
        self, beginning: Vertex, vertex: Vertex, j: int, lengths: list[int], to_go: float
    ) -> Find:
        """What was found from a vertex, as a shortcut that begins there or before."""
        source = self.graph.nodes[beginning.node]
        change = Change.between(source, self.graph.nodes[j])
        context = context_of(source, learner_interface(self._domain).grasping, self.space)
        motions = vertex.cost - beginning.cost
        steps = min(lengths)
        hoped = beginning.cost + MERGED * motions + steps
        return Find(
            Signature.of(change, self.space, context),
            origin_of(beginning),
            len(lengths),
            motions + steps,
            self._plan.predicted_steps,
            self._plan.predicted_steps - (hoped + to_go),
        )

    def _collect(self) -> tuple[list[Vertex], dict[str, float]]:
        """The cheapest nodes to reach, and what operators cost on average."""
        costs: dict[str, list[int]] = {}
        for edge in self._plan.edges:
            costs.setdefault(edge.option.skill.name, []).append(edge.predicted_steps)
        vertices = []
        for vertex in self._cheapest_first():
            if vertex.edge is not None and vertex.parent is not None:
                steps = vertex.cost - vertex.parent.cost
                costs.setdefault(vertex.edge.option.skill.name, []).append(steps)
            vertices.append(vertex)
            if len(vertices) == self._settings.nodes:
                break
        return vertices, {name: float(np.mean(steps)) for name, steps in costs.items()}

    def _cheapest_first(self) -> Iterator[Vertex]:
        """Each node once, in the state in which it is reached first (Dijkstra)."""
        forward, goals = self.graph.forward_edges(), set(self.graph.goal_nodes)
        tie = count()
        queue = [(0, next(tie), Vertex(0, self.task.initial_state, 0))]
        closed: set[int] = set()
        while queue:
            _, _, vertex = heapq.heappop(queue)
            if vertex.node in closed:
                continue
            closed.add(vertex.node)
            yield vertex
            for edge in forward[vertex.node] if vertex.node not in goals else []:
                reached = self.follow(vertex, edge)
                if reached is not None:
                    heapq.heappush(queue, (reached.cost, next(tie), reached))

    def follow(self, vertex: Vertex, edge: Edge) -> Vertex | None:
        """Where an edge leads to from a vertex, if anywhere."""
        target = self.graph.nodes[edge.target]
        rollout = self._problem.model.roll_out(edge.option, vertex.state, target)
        self._steps += rollout.steps
        if not rollout.reached:
            return None
        return Vertex(edge.target, rollout.final, vertex.cost + rollout.steps, vertex, edge)

    def _roll_out(self, vertex: Vertex, index: Mapping[int, int]) -> dict[int, list[int]]:
        """Random rollouts, for all targets at once: steps to each node reached, by node."""
        reached: dict[int, list[int]] = {}
        for _ in range(0, self._settings.rollouts, len(self._gripper)):
            for first in self._some_rollouts(vertex.state, index):
                for j, steps in first.items():
                    if j > vertex.node:
                        reached.setdefault(j, []).append(steps)
        return reached

    def _some_rollouts(self, state: State, index: Mapping[int, int]) -> list[dict[int, int]]:
        """In every world: the first step at which each node was reached, with all at rest."""
        learner, to_action = learner_interface(self._domain), ActionMap(self._domain, gripper=True)
        worlds = len(self._gripper)
        for world in range(worlds):
            self._worlds.reset(world, state)
        first: list[dict[int, int]] = [{} for _ in range(worlds)]
        alive = np.ones(worlds, dtype=bool)
        for step in range(self._settings.length):
            if step % self._settings.hold == 0:
                directions = self._directions(to_action.size)
            states = self._worlds.step(to_action(directions))
            alive &= ~learner.failed(states)
            self._steps += int(alive.sum())
            at_rest = np.flatnonzero(alive & learner.at_rest(states))
            there = []
            if at_rest.size:
                there = self.space.abstract_each(State(states.layout, states.data[at_rest]))
            for number, abstract in zip(at_rest.tolist(), there, strict=True):
                if abstract in index:
                    first[number].setdefault(index[abstract], step + 1)
            if not alive.any():
                break
        return first

    def _directions(self, axes: int) -> NDArray[np.float64]:
        """Random ones, for every world; the gripper acts now and then, and in some only."""
        directions = self._rng.uniform(-1.0, 1.0, (len(self._gripper), axes))
        commands = self._rng.choice(GRIPPER_CHOICES, len(self._gripper))
        directions[:, -1] = np.where(self._gripper, commands, 0.0)
        return directions


def origin_of(vertex: Vertex) -> Origin:
    """The operators by which a vertex was reached."""
    names: list[str] = []
    at: Vertex | None = vertex
    while at is not None and at.edge is not None:
        names.append(at.edge.option.skill.name)
        at = at.parent
    return tuple(reversed(names))


def ways_to_goal(graph: AbstractGraph, operator_steps: Mapping[str, float]) -> list[float]:
    """Steps from each node to a goal, with operators at their mean; infinite without a way."""
    usual = float(np.mean(list(operator_steps.values()) or [1.0]))
    incoming: list[list[Edge]] = [[] for _ in graph.nodes]
    for edge in graph.edges:
        incoming[edge.target].append(edge)
    ways = [float("inf")] * len(graph.nodes)
    queue = [(0.0, goal) for goal in graph.goal_nodes]
    for _, goal in queue:
        ways[goal] = 0.0
    while queue:
        way, node = heapq.heappop(queue)
        if way > ways[node]:
            continue
        for edge in incoming[node]:
            longer = way + operator_steps.get(edge.option.skill.name, usual)
            if longer < ways[edge.source]:
                ways[edge.source] = longer
                heapq.heappush(queue, (longer, edge.source))
    return ways
