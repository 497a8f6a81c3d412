# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Collect and prune: which shortcuts are worth learning (SLAP §4.2, Alg. 1).

The paper records the low-level states of a whole abstract graph and makes random rollouts from
all of them. What a shortcut from node i to node j can save, though, is the cost of the best plan
less the costs of the way to i, of the shortcut, and of the way on from j. So nodes are explored in
the order of the cost to reach them, and the rest of the way is estimated with the mean cost of
each operator.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain, Task
from slap_ros.learning.stored_keys import restored, stored
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.plan import Plan
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import Vertex
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.shortcuts.settings import ExplorationSettings
from slap_ros.shortcuts.signature import Change, Signature, context_of

OperatorPath = tuple[str, ...]  # operators by which a shortcut's source was reached
ABSORBED_MOTION = 0.5  # share of a motion's steps that remain where it is part of a shortcut
UNBATCHED_WORLDS = 4  # worlds where a domain's cannot be stepped together
KEEPS = 3  # times that a gripper stays as it is, for each that it closes and each that it opens


@dataclass(frozen=True)
class ShortcutCandidate:
    """A pair of abstract states, up to objects, that random rollouts joined.

    Args:
        signature: Lifted change from the first abstract state to the second.
        operator_path: Names of the operators by which the source was reached.
        hits: Number of rollouts that reached the target.
        steps: Environment steps of the shortest of these rollouts, and of the options before it
            that the shortcut would replace.
        plan_steps: Environment steps of the plan without the shortcut.
        expected_saving: Environment steps by which the shortcut is expected to shorten the plan.
    """

    signature: Signature
    operator_path: OperatorPath
    hits: int
    steps: int
    plan_steps: int
    expected_saving: float

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`."""
        return stored(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ShortcutCandidate:
        """The candidate of :meth:`as_json`.

        Raises:
            KeyError, TypeError, ValueError: The data is no candidate.
        """
        values = restored(cls, data)
        names = ("hits", "steps", "plan_steps", "expected_saving")
        numbers = {name: values[name] for name in names}
        if not all(isinstance(value, int | float) for value in numbers.values()):
            raise TypeError(f"{numbers} are not all numbers")
        operator_path = tuple(str(name) for name in values["operator_path"])
        return cls(Signature.from_json(values["signature"]), operator_path, **numbers)


@dataclass(frozen=True)
class ExplorationResult:
    """The outcome of exploring one task.

    Args:
        candidates: Candidates that were not pruned and are expected to shorten the plan.
        pairs: Number of pairs of abstract states that no option joins: the paper's candidates.
        environment_steps: Environment steps simulated while exploring.
        operator_steps: Mean environment steps of each operator, by name.
    """

    candidates: tuple[ShortcutCandidate, ...]
    pairs: int
    environment_steps: int
    operator_steps: Mapping[str, float]

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`."""
        return stored(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ExplorationResult:
        """The result of :meth:`as_json`.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: The data is no result.
        """
        values = restored(cls, data)
        return cls(
            tuple(ShortcutCandidate.from_json(candidate) for candidate in values["candidates"]),
            int(values["pairs"]),
            int(values["environment_steps"]),
            {str(name): float(mean) for name, mean in values["operator_steps"].items()},
        )


class Explorer:
    """Explores one task: collects states, makes random rollouts, values what they reached."""

    def __init__(
        self,
        domain: Domain,
        problem: Problem,
        task: Task,
        plan: Plan,
        settings: ExplorationSettings,
        rng: np.random.Generator,
    ) -> None:
        """Build the task's abstract graph; see :meth:`of_task`.

        Args:
            domain: Domain of the task.
            problem: Operators and model over the task's objects.
            task: Task to explore.
            plan: Plan without shortcuts for the task.
            settings: Number of rollouts, number of nodes that they begin in, and other settings of
                exploration.
            rng: Generator that draws the random actions.
        """
        self.task = task
        self._domain, self._problem, self._plan = domain, problem, plan
        self._settings, self._rng = settings, rng
        self.space = problem.model.space
        self._grasping = self.space.mask(
            atom
            for atom in self.space.atoms
            if atom.predicate in learner_interface(domain).grasping
        )
        self.graph = build_abstract_graph(
            self.space.abstract(task.initial_state), self.space.mask(task.goal), problem.operators
        )
        worlds = settings.rollouts if domain.steps_together else UNBATCHED_WORLDS
        self._worlds = domain.make_vector_world([task.initial_state] * worlds)
        self._grips = np.arange(worlds) % 2 == 1  # whether the gripper acts in a world
        self._steps = 0

    @classmethod
    def of_task(
        cls,
        domain: Domain,
        seed: int,
        index: int,
        settings: ExplorationSettings,
        rng: np.random.Generator,
    ) -> Explorer:
        """The explorer of a task, which is planned for first.

        Args:
            domain: Domain of the task.
            seed: Seed of the task.
            index: Index of the task.
            settings: Number of rollouts, number of nodes that they begin in, and other settings of
                exploration.
            rng: Generator that draws the random actions.

        Raises:
            UnsolvableError: The task has no plan.
            PlanningLimitError: A limit was reached before a plan was found.
        """
        task = domain.task(seed, index)
        problem = Problem.of(domain, task.initial_state)
        goal = problem.model.space.mask(task.goal)
        plan = GraphPlanner(problem).plan(task.initial_state, goal).plan
        return cls(domain, problem, task, plan, settings, rng)

    def explore(self) -> ExplorationResult:
        """Collect states, roll out from them, value what was reached."""
        vertices, operator_steps = self._collect()
        to_go = steps_to_goal(self.graph, operator_steps)
        joined = {(edge.source, edge.target) for edge in self.graph.edges}
        candidates = []
        for vertex in vertices:
            for j, lengths in self._roll_out(vertex).items():
                if len(lengths) < self._settings.hits:
                    continue
                candidates += [
                    self._candidate(source, vertex, j, lengths, to_go[j])
                    for source in self._sources(vertex)
                    if (source.node, j) not in joined
                ]
        return ExplorationResult(
            tuple(candidate for candidate in candidates if candidate.expected_saving > 0.0),
            len(self.graph.candidates()),
            self._steps,
            operator_steps,
        )

    def _sources(self, vertex: Vertex) -> Iterator[Vertex]:
        """Yield the vertices where a shortcut may begin that does what rollouts from a vertex did.

        At the vertex itself, or before the options that led there as far as they change nothing
        in what is held: a shortcut may well learn to move there by itself.
        """
        yield vertex
        while vertex.parent is not None:
            nodes = self.graph.nodes[vertex.parent.node], self.graph.nodes[vertex.node]
            if (nodes[0] ^ nodes[1]) & self._grasping:
                return
            vertex = vertex.parent
            yield vertex

    def _candidate(
        self, source: Vertex, vertex: Vertex, j: int, lengths: list[int], to_go: float
    ) -> ShortcutCandidate:
        """The candidate: a shortcut from ``source`` to what rollouts from a vertex reached.

        Args:
            source: Vertex in which the shortcut begins: ``vertex`` or one before it; see
                :meth:`_sources`.
            vertex: Vertex from which the rollouts were made.
            j: Index of the node that the rollouts reached.
            lengths: Environment steps of each rollout until it reached the node.
            to_go: Estimated environment steps from the node to a goal.

        Returns:
            The candidate, whose expected saving may be negative.
        """
        node = self.graph.nodes[source.node]
        change = Change.between(node, self.graph.nodes[j])
        context = context_of(node, learner_interface(self._domain).grasping, self.space)
        motions = vertex.g - source.g
        steps = min(lengths)
        expected = source.g + ABSORBED_MOTION * motions + steps
        return ShortcutCandidate(
            Signature.of(change, self.space, context),
            operator_path_to(source),
            len(lengths),
            motions + steps,
            self._plan.predicted_steps,
            self._plan.predicted_steps - (expected + to_go),
        )

    def _collect(self) -> tuple[list[Vertex], dict[str, float]]:
        """The cheapest nodes to reach, and the mean steps of each operator."""
        costs: dict[str, list[int]] = {}
        for edge in self._plan.edges:
            costs.setdefault(edge.option.skill.name, []).append(edge.predicted_steps)
        vertices = []
        for vertex in self._cheapest_first():
            if vertex.edge is not None and vertex.parent is not None:
                steps = vertex.g - vertex.parent.g
                costs.setdefault(vertex.edge.option.skill.name, []).append(steps)
            vertices.append(vertex)
            if len(vertices) == self._settings.nodes:
                break
        return vertices, {name: float(np.mean(steps)) for name, steps in costs.items()}

    def _cheapest_first(self) -> Iterator[Vertex]:
        """Yield each node once, in the state in which it is reached first (Dijkstra)."""
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
                reached = self._follow(vertex, edge)
                if reached is not None:
                    heapq.heappush(queue, (reached.g, next(tie), reached))

    def _follow(self, vertex: Vertex, edge: Edge) -> Vertex | None:
        """The vertex that an edge leads to from another; None where it cannot be executed."""
        target = edge.option.target(self.graph.nodes[edge.target])
        rollout = self._problem.model.roll_out(edge.option, vertex.state, target)
        self._steps += rollout.steps
        if not rollout.reached:
            return None
        return Vertex(edge.target, rollout.final, vertex.g + rollout.steps, vertex, edge)

    def _roll_out(self, vertex: Vertex) -> dict[int, list[int]]:
        """Random rollouts, for all targets at once: steps to each node reached, by node.

        Where more atoms hold in the vertex than in its node, they have to stay.
        """
        abstract, node = self.space.abstract(vertex.state), self.graph.nodes[vertex.node]
        index = {
            Change.between(node, target).apply(abstract): j
            for j, target in enumerate(self.graph.nodes)
        }
        reached: dict[int, list[int]] = {}
        for _ in range(0, self._settings.rollouts, len(self._grips)):
            for first in self._roll_out_batch(vertex.state, index):
                for j, steps in first.items():
                    if j > vertex.node:
                        reached.setdefault(j, []).append(steps)
        return reached

    def _roll_out_batch(self, state: State, index: Mapping[int, int]) -> list[dict[int, int]]:
        """The first step at which each node was reached, with all at rest, in every world."""
        learner, to_action = learner_interface(self._domain), ActionMap(self._domain, gripper=True)
        worlds = len(self._grips)
        for world in range(worlds):
            self._worlds.reset(world, state)
        first: list[dict[int, int]] = [{} for _ in range(worlds)]
        alive = np.ones(worlds, dtype=bool)
        for step in range(self._settings.length):
            if step % self._settings.action_repeat == 0:
                actions = self._random_actions(to_action)
            states = self._worlds.step(actions)
            alive &= ~learner.failed(states)
            self._steps += int(alive.sum())
            at_rest = np.flatnonzero(alive & learner.at_rest(states))
            abstracts = []
            if at_rest.size:
                abstracts = self.space.abstract_each(State(states.layout, states.data[at_rest]))
            for number, abstract in zip(at_rest.tolist(), abstracts, strict=True):
                if abstract in index:
                    first[number].setdefault(index[abstract], step + 1)
            if not alive.any():
                break
        return first

    def _random_actions(self, to_action: ActionMap) -> NDArray[np.float64]:
        """Random actions, shape (worlds, axes); in every second world the gripper acts too."""
        actions = to_action(self._rng.uniform(-1.0, 1.0, (len(self._grips), to_action.size)))
        space = self._domain.learned_actions
        if space.gripper is not None:
            choices = np.array([*(0.0,) * KEEPS, space.gripper.closes, space.gripper.opens])
            commands = self._rng.choice(choices, len(self._grips))
            actions[:, space.gripper_index] = np.where(self._grips, commands, 0.0)
        return actions


def operator_path_to(vertex: Vertex) -> OperatorPath:
    """The names of the operators by which a vertex was reached."""
    names: list[str] = []
    at: Vertex | None = vertex
    while at is not None and at.edge is not None:
        names.append(at.edge.option.skill.name)
        at = at.parent
    return tuple(reversed(names))


def steps_to_goal(graph: AbstractGraph, operator_steps: Mapping[str, float]) -> list[float]:
    """Estimated environment steps from each node to a goal; infinite where there is no way.

    Operators count with their mean, and those without one with the mean of the others.
    """
    usual = float(np.mean(list(operator_steps.values()) or [1.0]))
    incoming: list[list[Edge]] = [[] for _ in graph.nodes]
    for edge in graph.edges:
        incoming[edge.target].append(edge)
    to_go = [float("inf")] * len(graph.nodes)
    queue = [(0.0, goal) for goal in graph.goal_nodes]
    for _, goal in queue:
        to_go[goal] = 0.0
    while queue:
        rest, node = heapq.heappop(queue)
        if rest > to_go[node]:
            continue
        for edge in incoming[node]:
            longer = rest + operator_steps.get(edge.option.skill.name, usual)
            if longer < to_go[edge.source]:
                to_go[edge.source] = longer
                heapq.heappush(queue, (longer, edge.source))
    return to_go
