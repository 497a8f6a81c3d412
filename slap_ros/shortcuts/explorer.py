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

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from slap_ros.core import Domain, Task
from slap_ros.errors import UnsolvableError
from slap_ros.planning.plan import Plan
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import Vertex
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.shortcuts.approaches import Approacher
from slap_ros.shortcuts.candidate_valuation import CandidateValuation
from slap_ros.shortcuts.cheapest_vertices import CheapestVertices
from slap_ros.shortcuts.exploration_policies import within_reach
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.exploration_rollouts import ExplorationRollouts, RolloutHits
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.exploration_steps import most_rollout_steps
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT, KeptShortcuts, graph_of
from slap_ros.shortcuts.rollout_origins import OptionRetracer, RolloutOrigin
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.straightened_chains import StraightenedChains
from slap_ros.shortcuts.straightening import STRAIGHTENED
from slap_ros.shortcuts.way_on import WayOn


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
        self._grasp_atoms = learner_interface(domain).grasp_atoms(self.space)
        self.graph = graph_of(
            kept.planner(domain, problem, task.initial_state),
            self.space.abstract(task.initial_state),
            self.space.mask(task.goal),
        )
        self._cheapest = CheapestVertices(task, self.graph, problem.model)
        self._rollouts = ExplorationRollouts(domain, task, self.space, settings, rng)
        self._retracer = OptionRetracer(
            domain.model_world(task.initial_state), self.space, domain.action_space
        )
        self._approacher = Approacher(domain, task.initial_state)
        self._chains = StraightenedChains(domain, problem, self.graph, settings.regrasps)
        self._way_on = WayOn(problem, self.graph.goal)
        self._shown: tuple[ShortcutCandidate, ...] = ()

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
    def shown(self) -> tuple[ShortcutCandidate, ...]:
        """What exploration has shown to be possible, whether or not it shortens the plan."""
        return self._shown

    def signature(self, source: int, target: int) -> Signature:
        """The signature of a shortcut between two abstract states, masks."""
        grasping = learner_interface(self._domain).grasping
        return Signature.between(source, target, self.space, grasping)

    def explore(self) -> ExplorationResult:
        """Collect states, roll out from them, value what was reached."""
        vertices = list(islice(self._cheapest, self._settings.nodes))
        operator_steps = self._operator_steps(vertices)
        valuation = CandidateValuation(
            self._domain,
            self.space,
            self.graph,
            self.plan_steps,
            operator_steps,
            self._way_on if self._settings.beyond else None,
        )
        candidates = [*self._rolled_out(vertices, valuation)]
        if self._settings.straightened:
            candidates += self._straightened(vertices, valuation)
        self._shown = tuple(candidates)
        return ExplorationResult(
            tuple(candidate for candidate in candidates if candidate.expected_saving > 0.0),
            len(self.graph.candidates()),
            self._taken,
            operator_steps,
        )

    def _operator_steps(self, vertices: Sequence[Vertex]) -> dict[str, float]:
        """The mean environment steps of each operator, in the plan and on the way to vertices."""
        steps: dict[str, list[int]] = {}
        for edge in self._plan.edges:
            steps.setdefault(edge.option.skill.name, []).append(edge.predicted_steps)
        for vertex in vertices:
            if vertex.edge is not None and vertex.parent is not None:
                name = vertex.edge.option.skill.name
                steps.setdefault(name, []).append(vertex.g - vertex.parent.g)
        return {name: float(np.mean(each)) for name, each in steps.items()}

    def _rolled_out(
        self, vertices: Sequence[Vertex], valuation: CandidateValuation
    ) -> Iterator[ShortcutCandidate]:
        """Yield the candidates that enough rollouts from vertices show.

        Args:
            vertices: Vertices at which, near which and before which rollouts begin.
            valuation: Values what they reach.
        """
        for origin in self._origins(vertices):
            if not self._affords_rollouts(origin.state):
                return
            if not self._rollouts.can_begin(origin.state):
                continue
            for abstract, hits in self._rollouts.roll_out(origin).items():
                if len(hits.lengths) < self._settings.hits:
                    continue
                there = valuation.destination_of(origin.vertex, abstract, hits, self._left)
                if there is not None:
                    yield from valuation.candidates(origin, there, hits)

    def _straightened(
        self, vertices: Sequence[Vertex], valuation: CandidateValuation
    ) -> Iterator[ShortcutCandidate]:
        """Yield the candidates that two skills show, executed one after the other and straightened.

        Args:
            vertices: Vertices in which the first of the skills may begin, beside those of the plan.
            valuation: Values what the skills do.
        """
        tries = self._settings.straightened
        for vertex in self._sources_of_chains(vertices):
            for pair in self._chains.leading_from(vertex.node):
                if not valuation.is_useful(vertex, pair[1].target):
                    continue
                if self._chains.most_steps(pair, tries) > self._left:
                    return
                found = self._chains.straighten(vertex.state, vertex.node, pair, tries, self._rng)
                if found is None:
                    continue
                steps, found_by = found.steps, {STRAIGHTENED: None}
                hits = RolloutHits(found.states[-1], steps, [steps], found_by)
                origin = RolloutOrigin(vertex, vertex.state)
                there = valuation.destination(pair[1].target)
                yield replace(
                    valuation.candidate(vertex, origin, there, hits),
                    signature=self._chains.signature(vertex.node, pair),
                    replaced=tuple(edge.option.skill.name for edge in pair),
                )

    def _sources_of_chains(self, vertices: Sequence[Vertex]) -> list[Vertex]:
        """The vertices in which the first of two skills may begin."""
        possible = list(vertices)
        if self._settings.along_plan:
            possible += self._cheapest.along(self._plan, {vertex.node for vertex in vertices})
        return [vertex for vertex in possible if self._rollouts.can_begin(vertex.state)]

    @property
    def _taken(self) -> int:
        """Environment steps so far."""
        return sum(
            part.steps
            for part in (
                self._cheapest,
                self._rollouts,
                self._retracer,
                self._approacher,
                self._chains,
                self._way_on,
            )
        )

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
                    if not (before ^ self.space.abstract(origin.state)) & self._grasp_atoms:
                        yield origin

    def _approached(self, vertex: Vertex) -> Iterator[RolloutOrigin]:
        """Yield where approaches lead from a vertex, as far as the budget goes."""
        if not self._rollouts.can_begin(vertex.state):
            return
        for obj in within_reach(self._domain, vertex.state):
            if self._approacher.most_steps(vertex.state, obj) > self._left:
                return
            for there in list(self._approacher.approach(vertex.state, obj)):
                steps = len(there.commands)
                yield RolloutOrigin(vertex, there.state, steps, there.onwards)
