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
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any

import numpy as np

from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidStateError, UnsolvableError
from slap_ros.learning.stored_keys import restored, stored
from slap_ros.planning.abstract_graph import Edge
from slap_ros.planning.plan import Plan
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import Vertex
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.shortcuts.approaches import APPROACHED, Approacher
from slap_ros.shortcuts.exploration_policies import (
    RANDOM,
    ExplorationPolicy,
    PushAim,
    RandomExploration,
    within_reach,
)
from slap_ros.shortcuts.exploration_steps import exploration_worlds, most_rollout_steps
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT, KeptShortcuts, graph_of
from slap_ros.shortcuts.rollout_origins import OptionRetracer, RolloutOrigin
from slap_ros.shortcuts.settings import ExplorationSettings
from slap_ros.shortcuts.signature import Change, Signature, context_of
from slap_ros.shortcuts.straightened_chains import StraightenedChains
from slap_ros.shortcuts.straightening import STRAIGHTENED
from slap_ros.shortcuts.way_on import WayOn, steps_to_goal

OperatorPath = tuple[str, ...]  # operators by which a shortcut's source was reached
ABSORBED_MOTION = 0.5  # share of a motion's steps that remain where it is part of a shortcut


@dataclass(frozen=True)
class ShortcutCandidate:
    """A pair of abstract states, up to objects, that rollouts joined.

    Args:
        signature: Lifted change from the first abstract state to the second.
        operator_path: Names of the operators by which the source was reached.
        hits: Number of rollouts that reached the target.
        steps: Environment steps of the shortest of these rollouts, and of the options before it
            that the shortcut would replace.
        plan_steps: Environment steps of the plan without the shortcut.
        expected_saving: Environment steps by which the shortcut is expected to shorten the plan.
        beyond: Whether operators alone reach the second abstract state in no plan, so that it is
            no node of the abstract planning graph.
        found_by: Names of the exploration policies whose rollouts reached the target.
        replaced: Names of the skills that show it; none where something else found it.
    """

    signature: Signature
    operator_path: OperatorPath
    hits: int
    steps: int
    plan_steps: int
    expected_saving: float
    beyond: bool = False
    found_by: tuple[str, ...] = (RANDOM,)
    replaced: OperatorPath = ()

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`.

        What random actions found within the graph says no more than in work folders from when
        there was nothing else.
        """
        data = stored(self)
        if not self.beyond:
            del data["beyond"]
        if self.found_by == (RANDOM,):
            del data["found_by"]
        if not self.replaced:
            del data["replaced"]
        return data

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
        found_by = tuple(str(name) for name in values.get("found_by", (RANDOM,)))
        replaced = tuple(str(name) for name in values.get("replaced", ()))
        signature, beyond = Signature.from_json(values["signature"]), bool(values.get("beyond"))
        return cls(
            signature, operator_path, **numbers, beyond=beyond, found_by=found_by, replaced=replaced
        )


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


@dataclass
class _Reached:
    """Rollouts that reached an abstract state.

    Args:
        shortest: State in which the shortest of them was there.
        least: Environment steps of the shortest.
        lengths: Environment steps of each rollout until it was there.
        found_by: Names of the exploration policies of the rollouts, without repetitions.
    """

    shortest: State
    least: int
    lengths: list[int] = field(default_factory=list)
    found_by: dict[str, None] = field(default_factory=dict)  # a set that keeps its order

    def add(self, steps: int, state: State, policy: ExplorationPolicy) -> None:
        """Take note of one more rollout, which was there after so many steps, in a state."""
        if steps < self.least:
            self.shortest, self.least = state, steps
        self.lengths.append(steps)
        self.found_by[policy.name] = None


@dataclass(frozen=True)
class _Destination:
    """Where a shortcut would lead.

    Args:
        node: Abstract state, a mask.
        to_go: Estimated environment steps from there to a goal.
        beyond: Whether the abstract planning graph does not have it.
    """

    node: int
    to_go: float
    beyond: bool


class Explorer:
    """Explores one task: collects states, makes rollouts, values what they reached."""

    def __init__(
        self,
        domain: Domain,
        problem: Problem,
        task: Task,
        plan: Plan,
        settings: ExplorationSettings,
        rng: np.random.Generator,
        kept: KeptShortcuts = NOTHING_KEPT,
    ) -> None:
        """Build the task's abstract graph; see :meth:`of_task`.

        Args:
            domain: Domain of the task.
            problem: Operators and model over the task's objects.
            task: Task to explore.
            plan: Plan for the task, with no other shortcuts than those kept.
            settings: Number of rollouts, number of nodes that they begin in, and other settings of
                exploration.
            rng: Generator that draws the random actions.
            kept: Shortcuts that are options like any other.
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
        self.graph = graph_of(
            kept.planner(domain, problem, task.initial_state),
            self.space.abstract(task.initial_state),
            self.space.mask(task.goal),
        )
        nodes = self.graph.nodes
        self._joined = {(nodes[edge.source], nodes[edge.target]) for edge in self.graph.edges}
        self._count = worlds = exploration_worlds(domain, settings)
        self._worlds = domain.make_vector_world([task.initial_state] * worlds)
        self._aim = PushAim(domain, self._worlds, worlds, rng)
        self._retracer = OptionRetracer(
            domain.model_world(task.initial_state), self.space, domain.action_space
        )
        self._approacher = Approacher(domain, task.initial_state)
        self._indexed: tuple[Vertex, Mapping[int, int]] | None = None  # of the latest vertex
        self._way_on = WayOn(problem, self.graph.goal)
        self._hits: Counter[tuple[int, int]] = Counter()
        self._steps = 0

    @classmethod
    def of_task(
        cls,
        domain: Domain,
        seed: int,
        index: int,
        settings: ExplorationSettings,
        rng: np.random.Generator,
        kept: KeptShortcuts = NOTHING_KEPT,
    ) -> Explorer:
        """The explorer of a task, which is planned for first.

        Args:
            domain: Domain of the task.
            seed: Seed of the task.
            index: Index of the task.
            settings: Number of rollouts, number of nodes that they begin in, and other settings of
                exploration.
            rng: Generator that draws the random actions.
            kept: Shortcuts that are options like any other.

        Raises:
            UnsolvableError: The task has no plan that reaches the goal in the model.
            PlanningLimitError: A limit was reached before a plan was found.
        """
        task = domain.task(seed, index)
        problem = Problem.of(domain, task.initial_state)
        goal = problem.model.space.mask(task.goal)
        found = kept.planner(domain, problem, task.initial_state).plan(task.initial_state, goal)
        if found.fails:  # its steps end there, and say nothing of how long a plan is
            raise UnsolvableError(found.fails)
        return cls(domain, problem, task, found.plan, settings, rng, kept)

    @property
    def plan_steps(self) -> int:
        """Environment steps of the plan, with no other shortcuts than those kept."""
        return self._plan.predicted_steps

    @property
    def hits(self) -> Mapping[tuple[int, int], int]:
        """Rollouts so far that joined two abstract states, masks, which no option joins."""
        return self._hits

    def signature(self, source: int, target: int) -> Signature:
        """The signature of a shortcut between two abstract states, masks."""
        context = context_of(source, learner_interface(self._domain).grasping, self.space)
        return Signature.of(Change.between(source, target), self.space, context)

    def explore(self) -> ExplorationResult:
        """Collect states, roll out from them, value what was reached."""
        vertices, operator_steps = self._collect()
        to_go = steps_to_goal(self.graph, operator_steps)
        candidates: list[ShortcutCandidate] = []
        for origin in self._origins(vertices):
            if not self._affords_rollouts(origin.state):
                break
            if not self._accepts(origin.state):
                continue
            for abstract, reached in self._roll_out(origin).items():
                if len(reached.lengths) < self._settings.hits:
                    continue
                target = self._destination(origin, abstract, reached, to_go, operator_steps)
                if target is not None:
                    candidates += self._candidates(origin, target, reached)
        if self._settings.straightened:
            along = self._along_plan(vertices) if self._settings.along_plan else []
            possible = [vertex for vertex in (*vertices, *along) if self._accepts(vertex.state)]
            candidates += self._straightened(possible, to_go)
        return ExplorationResult(
            tuple(candidate for candidate in candidates if candidate.expected_saving > 0.0),
            len(self.graph.candidates()),
            self._taken,
            operator_steps,
        )

    def _straightened(
        self, vertices: Sequence[Vertex], to_go: Sequence[float]
    ) -> Iterator[ShortcutCandidate]:
        """Yield the candidates that two skills show, executed one after the other and straightened.

        Args:
            vertices: Vertices in which the first of the skills may begin.
            to_go: Estimated environment steps from each node to a goal.
        """
        regrasps = self._settings.regrasps
        chains = StraightenedChains(self._domain, self._problem, self.graph, regrasps)
        nodes, tries = self.graph.nodes, self._settings.straightened
        for vertex in vertices:
            for pair in chains.leading_from(vertex.node):
                end = pair[1].target
                useful = vertex.g + to_go[end] < self._plan.predicted_steps
                if not useful or (nodes[vertex.node], nodes[end]) in self._joined:
                    continue
                if chains.most_steps(pair, tries) > self._left:
                    return
                before = chains.steps
                found = chains.straighten(vertex.state, vertex.node, pair, tries, self._rng)
                self._steps += chains.steps - before
                if found is not None:
                    reached = _Reached(found.states[-1], found.steps, [found.steps])
                    reached.found_by[STRAIGHTENED] = None
                    target = _Destination(nodes[end], to_go[end], beyond=False)
                    origin = RolloutOrigin(vertex, vertex.state)
                    yield replace(
                        self._candidate(vertex, origin, target, reached),
                        signature=chains.signature(vertex.node, pair),
                        replaced=tuple(edge.option.skill.name for edge in pair),
                    )

    def _along_plan(self, vertices: Sequence[Vertex]) -> list[Vertex]:
        """The vertices that the plan leads to, without those of nodes that are among others.

        Args:
            vertices: The others.
        """
        known, at, found = {v.node for v in vertices}, Vertex(0, self.task.initial_state, 0), []
        forward = self.graph.forward_edges()
        for option in (planned.option for planned in self._plan.edges):
            same = (e for e in forward[at.node] if str(e.option) == str(option))
            ways = (self._follow(at, replace(e, option=option)) for e in same)  # in that attempt
            following = next((way for way in ways if way is not None), None)
            if following is None:
                break
            at = following
            if at.node not in known:
                found.append(at)
        return found

    @property
    def _taken(self) -> int:
        """Environment steps so far."""
        others = self._aim, self._retracer, self._approacher, self._way_on
        return self._steps + sum(other.steps for other in others)

    @property
    def _left(self) -> float:
        """Environment steps that are left of the budget; infinite where there is none."""
        budget = self._settings.budget
        return budget - self._taken if budget else float("inf")

    def _affords_rollouts(self, state: State) -> bool:
        """Whether what is left of the budget is enough for all rollouts from a state."""
        # Without a budget nobody needs to know which objects are within reach.
        settings = self._settings
        return not settings.budget or (
            most_rollout_steps(self._domain, settings, state) <= self._left
        )

    def _origins(self, vertices: Sequence[Vertex]) -> Iterator[RolloutOrigin]:
        """Yield where rollouts begin: in vertices, near objects, and inside options that led there.

        A shortcut from inside an option begins where the option does. So what is held must be what
        was held there.
        """
        for vertex in vertices:
            yield RolloutOrigin(vertex, vertex.state)
            if self._settings.approaches:
                yield from self._approached(vertex)
            if self._settings.inside and vertex.edge is not None and vertex.parent is not None:
                if vertex.g - vertex.parent.g > self._left:
                    return
                target = vertex.edge.option.target(self.graph.nodes[vertex.node])
                # All at once: rollouts may use up what is left, and then no step may follow.
                for origin in list(self._retracer.inside(vertex, target, self._settings.inside)):
                    before = self.space.abstract(origin.vertex.state)
                    if not (before ^ self.space.abstract(origin.state)) & self._grasping:
                        yield origin

    def _approached(self, vertex: Vertex) -> Iterator[RolloutOrigin]:
        """Yield where approaches lead from a vertex, as far as the budget goes."""
        if not self._accepts(vertex.state):
            return
        for obj in within_reach(self._domain, vertex.state):
            if self._approacher.most_steps(vertex.state, obj) > self._left:
                return
            for there in list(self._approacher.approach(vertex.state, obj)):
                steps = len(there.commands)
                yield RolloutOrigin(vertex, there.state, steps, there.onwards)

    def _destination(
        self,
        origin: RolloutOrigin,
        abstract: int,
        reached: _Reached,
        to_go: Sequence[float],
        operator_steps: Mapping[str, float],
    ) -> _Destination | None:
        """Where a shortcut would lead that does what rollouts did; None where it is of no use.

        Where more atoms hold in the vertex than in its node, they have to stay.

        Args:
            origin: Origin of the rollouts.
            abstract: Abstract state that the rollouts reached, a mask.
            reached: Rollouts that reached it.
            to_go: Estimated environment steps from each node to a goal.
            operator_steps: Mean environment steps of each operator, by name.
        """
        vertex, nodes = origin.vertex, self.graph.nodes
        before = self.space.abstract(vertex.state)
        target = Change.between(before, abstract).apply(nodes[vertex.node])
        index = self._index_after(vertex)
        if abstract in index:
            j = index[abstract]
            return _Destination(nodes[j], to_go[j], beyond=False) if j > vertex.node else None
        if not self._settings.beyond or target in nodes:
            return None
        to_go_beyond = self._way_on.measure(reached.shortest, target, operator_steps, self._left)
        return _Destination(target, to_go_beyond, beyond=True)

    def _index_after(self, vertex: Vertex) -> Mapping[int, int]:
        """The nodes by the abstract states that are reached in them from a vertex."""
        if self._indexed is None or self._indexed[0] is not vertex:
            abstract, node = self.space.abstract(vertex.state), self.graph.nodes[vertex.node]
            index = {
                Change.between(node, target).apply(abstract): j
                for j, target in enumerate(self.graph.nodes)
            }
            self._indexed = vertex, index
        return self._indexed[1]

    def _sources(self, origin: RolloutOrigin) -> Iterator[Vertex]:
        """Yield the vertices where a shortcut may begin that does what rollouts did.

        At the vertex of the origin, or before the options that led there as far as they change
        nothing in what is held: a shortcut may well learn to move there by itself.
        """
        vertex = origin.vertex
        yield vertex
        while vertex.parent is not None:
            nodes = self.graph.nodes[vertex.parent.node], self.graph.nodes[vertex.node]
            if (nodes[0] ^ nodes[1]) & self._grasping:
                return
            vertex = vertex.parent
            yield vertex

    def _candidates(
        self, origin: RolloutOrigin, target: _Destination, reached: _Reached
    ) -> Iterator[ShortcutCandidate]:
        """Yield the candidates from wherever a shortcut to a destination may begin.

        Args:
            origin: Origin of the rollouts.
            target: Destination that the rollouts reached.
            reached: Rollouts that reached it.
        """
        for source in self._sources(origin):
            pair = self.graph.nodes[source.node], target.node
            if pair not in self._joined:
                self._hits[pair] += len(reached.lengths)
                yield self._candidate(source, origin, target, reached)

    def _candidate(
        self, source: Vertex, origin: RolloutOrigin, target: _Destination, reached: _Reached
    ) -> ShortcutCandidate:
        """The candidate: a shortcut from ``source`` to what rollouts reached.

        Args:
            source: Vertex in which the shortcut begins; see :meth:`_sources`.
            origin: Origin of the rollouts.
            target: Destination of the shortcut.
            reached: Rollouts that reached the destination.

        Returns:
            The candidate, whose expected saving may be negative.
        """
        motions, steps = origin.g - source.g, reached.least
        expected = source.g + ABSORBED_MOTION * motions + steps
        return ShortcutCandidate(
            self.signature(self.graph.nodes[source.node], target.node),
            operator_path_to(source),
            len(reached.lengths),
            motions + steps,
            self._plan.predicted_steps,
            self._plan.predicted_steps - (expected + target.to_go),
            target.beyond,
            tuple(reached.found_by),
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

    def _accepts(self, state: State) -> bool:
        """Whether rollouts can begin in a state: skills may end where nothing can begin."""
        try:
            self._worlds.reset(0, state)
        except InvalidStateError:
            return False
        return True

    def _roll_out(self, origin: RolloutOrigin) -> dict[int, _Reached]:
        """Rollouts, for all targets at once: those that reached each abstract state, a mask."""
        reached: dict[int, _Reached] = {}
        for policy in self._policies(origin):
            for first in self._roll_out_batch(origin.state, policy):
                for abstract, (steps, state) in first.items():
                    reached.setdefault(abstract, _Reached(state, steps)).add(steps, state, policy)
        return reached

    def _policies(self, origin: RolloutOrigin) -> Iterator[ExplorationPolicy]:
        """Yield a policy for each batch of rollouts from an origin."""
        settings = self._settings
        if origin.onwards is not None:
            for _ in range(settings.approaches):
                yield self._aim.along(origin.onwards, APPROACHED)
            return
        for _ in range(0, settings.rollouts, self._count):
            for repeat in filter(None, (settings.action_repeat, settings.also_repeat)):
                yield RandomExploration(self._domain, self._count, repeat, self._rng)
        for _ in range(settings.pushes):
            yield from self._aim.pushes(origin.state)

    def _roll_out_batch(
        self, state: State, policy: ExplorationPolicy
    ) -> list[dict[int, tuple[int, State]]]:
        """When and where each abstract state was first reached, at rest, in every world."""
        learner = learner_interface(self._domain)
        for world in range(self._count):
            self._worlds.reset(world, state)
        first: list[dict[int, tuple[int, State]]] = [{} for _ in range(self._count)]
        alive = np.ones(self._count, dtype=bool)
        for step in range(self._settings.length):
            states = self._worlds.step(policy.actions(step))
            alive &= ~learner.failed(states)
            self._steps += int(alive.sum())
            at_rest = np.flatnonzero(alive & learner.at_rest(states))
            abstracts: list[int] = []
            if at_rest.size:
                abstracts = self.space.abstract_each(State(states.layout, states.data[at_rest]))
            for number, abstract in zip(at_rest.tolist(), abstracts, strict=True):
                if abstract not in first[number]:
                    there = State(states.layout, states.data[number].copy())
                    first[number][abstract] = step + 1, there
            if not alive.any():
                break
        return first


def operator_path_to(vertex: Vertex) -> OperatorPath:
    """The names of the operators by which a vertex was reached."""
    names: list[str] = []
    at: Vertex | None = vertex
    while at is not None and at.edge is not None:
        names.append(at.edge.option.skill.name)
        at = at.parent
    return tuple(reversed(names))
