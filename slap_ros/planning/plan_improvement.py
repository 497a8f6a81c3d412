# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans from one state that get better: through a whole graph, or near the best one so far."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.corridor import CorridorBuilder
from slap_ros.planning.effort import Effort
from slap_ros.planning.ff_planner import FFPlanner
from slap_ros.planning.lazy_search import SearchLimits, search_lazily
from slap_ros.planning.look_ahead import LookAhead
from slap_ros.planning.model import CountedModel
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.planning.plan_proof import PlanProof
from slap_ros.planning.planner_choice import ANYTIME
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import SearchOutcome
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.relational import State

SMALL = 150  # abstract states of a graph in which nothing is gained by a first plan
NEAR_PLANS = 4  # roll-outs of a whole graph to one of graphs near plans
PROOFS = 8  # roll-outs and abstract states of a whole graph to those of proofs in its place
WEIGHTS = (30.0, 3.0, 1.0)  # of bounds of what is to come, one search after the other
SOON = 20  # roll-outs of a first search without a weight: where shortcuts are good, it ends by then
SEARCHES = ((1.0, SOON), *((weight, None) for weight in WEIGHTS))  # of a whole graph: roll-outs


class PlanImprovement:
    """One search for plans from a state, each of which is better than those before."""

    def __init__(
        self,
        problem: Problem,
        shortcuts: ShortcutSource | None,
        effort: Effort,
        state: State,
        goal: int,
        known: PlanningResult | None,
    ) -> None:
        """Search for nothing yet.

        Args:
            problem: The model, and the ground operators with their options.
            shortcuts: Where shortcut edges come from; None for pure planning.
            effort: How much planning may cost.
            state: Low-level state to start from.
            goal: Mask of atoms that must hold.
            known: Plan from there with what is proven; None without one.
        """
        self._state, self._goal = state, goal
        self._shortcuts, self._effort = shortcuts, effort
        self._whole_model = problem.model
        self._simulated_before = problem.model.executed
        self._model = CountedModel(problem.model)
        self._problem = replace(problem, model=self._model)
        self._limit = effort.rollouts
        self._best = None if known is None else known.plan
        self._no_first: PlanningLimitError | None = None  # why FF found no plan
        self._at_least = 0 if known is None else known.at_least  # environment steps of any plan
        self._is_modest = effort.within > 1.0  # content with a plan that is near the shortest
        most = effort.abstract_states(len(problem.operators)) // (1 if self._is_modest else PROOFS)
        self._proof = PlanProof(problem, shortcuts, state, goal, most)
        self._is_proving = known is None
        self._forget_failures = shortcuts.forget_failures_since_now() if shortcuts else _nothing

    def through(
        self, graph: AbstractGraph, add_shortcuts: Callable[[AbstractGraph], None]
    ) -> Iterator[PlanningResult]:
        """Search a graph as a whole, with falling weights where it is not small.

        Args:
            graph: The top level.
            add_shortcuts: Function that adds shortcuts to it, which takes longer than a first plan.
        """
        is_small = len(graph.nodes) <= SMALL
        if not (is_small or self._best):
            with suppress(PlanningLimitError):
                self._find_first()
                yield self._result(graph)
            if self._best is None:
                self._limit += self._model.executed  # what was tried in vain
        add_shortcuts(graph)
        ahead = LookAhead.of(graph)
        leads_to_goal = self._is_through(graph)
        for weight, rollouts in [(1.0, None)] if is_small else SEARCHES:
            outcome = self._search(graph, ahead, weight, rollouts)
            leads_to_goal |= outcome.plan is not None
            if leads_to_goal:  # else a deeper graph may have a plan that is shorter
                self._at_least = max(self._at_least, outcome.at_least or 0)
            if outcome.plan is None and not outcome.stopped and self._best is None:
                return  # nothing can be executed
            if self._take(outcome.plan) or self._is_proven():
                yield self._result(graph)
            if self._is_proven():
                return
        if self._best is None:
            self._find_first()
        yield self._result(graph)

    def near_plans(self, abstract: int) -> Iterator[PlanningResult]:
        """A first plan by the FF heuristic, then plans near the best one.

        Args:
            abstract: Abstract state to start from, a mask.

        Raises:
            PlanningLimitError: No plan was found that can be executed.
        """
        if self._best is None:
            with suppress(PlanningLimitError):  # a shortcut may still do what operators cannot
                first = self._find_first()
                self._prove(0)
                yield self._result(None, first.graph_nodes, first.graph_edges)
            if self._is_modest and self._best is not None and self._shortcuts is None:
                yield from self._good_enough()
            self._limit = self._model.executed + self._effort.rollouts // NEAR_PLANS
        yield from self._around(abstract)
        if self._best is None:
            self._find_first()
        elif self._is_modest and self._shortcuts is not None:  # they are found best near the start
            yield from self._good_enough()

    def _good_enough(self) -> Iterator[PlanningResult]:
        """Search for plans and proofs in turns, until a plan is good enough."""
        assert self._best is not None
        rollouts, within = self._effort.rollouts, self._effort.within
        rollouts -= rollouts // NEAR_PLANS
        while True:
            better = self._proof.shorter(self._best.predicted_steps, within, rollouts)
            if not self._take(better):
                break
            self._prove(0)
            yield self._result(None, *self._proof.size)
        if self._prove(0):
            yield self._result(None, *self._proof.size)

    def _around(self, abstract: int) -> Iterator[PlanningResult]:
        """Search near the start, where shortcuts pay most, then near each plan that is better."""
        builder = CorridorBuilder(self._goal, self._problem.operators, self._shortcuts)
        route: list[int] = [abstract]
        searched: Plan | None = None
        while True:
            graph = builder.around(route)
            ahead = LookAhead.of(graph)
            for weight in WEIGHTS:
                if self._take(self._search(graph, ahead, weight).plan):
                    yield self._result(graph)
            if self._is_proving and self._prove(self._effort.rollouts // PROOFS):
                yield self._result(graph)
            if self._best in (None, searched) or self._model.executed >= self._limit:
                return
            searched, route = self._best, [abstract, *self._on_the_way()]

    def _find_first(self) -> PlanningResult:
        """Take the plan that the FF heuristic finds, and what landmarks prove of any plan.

        Raises:
            PlanningLimitError: It finds none that can be executed, now or when it was asked before.
        """
        if self._no_first is not None:
            raise self._no_first
        self._at_least = max(self._at_least, self._proof.by_landmarks())
        try:
            first = FFPlanner(self._problem).plan(self._state, self._goal)
        except (UnsolvableError, PlanningLimitError) as error:
            self._no_first = PlanningLimitError(
                f"no plan within the effort of planning; give more, as in {ANYTIME}:effort=4: "
                f"{error}"
            )
            raise self._no_first from error
        self._proof.first_options = len(first.plan.edges)
        self._take(first.plan)
        return first

    def _search(
        self,
        graph: AbstractGraph,
        ahead: LookAhead,
        weight: float,
        rollouts: int | None = None,
    ) -> SearchOutcome:
        below = None if self._best is None else self._best.predicted_steps
        most = (
            self._limit if rollouts is None else min(self._limit, self._model.executed + rollouts)
        )
        limits = SearchLimits(weight, most, below)
        self._forget_failures()  # of searches that tried shortcuts elsewhere
        return search_lazily(graph, self._state, self._model, limits, ahead)

    def _take(self, plan: Plan | None) -> bool:
        """Keep a plan that is shorter than the best; whether it was."""
        if plan is None:
            return False
        if self._best is not None and plan.predicted_steps >= self._best.predicted_steps:
            return False
        self._best = plan
        return True

    def _on_the_way(self) -> list[int]:
        """The abstract states after each edge of the best plan but the last."""
        assert self._best is not None
        return [edge.target.required for edge in self._best.edges[:-1]]

    def _is_through(self, graph: AbstractGraph) -> bool:
        """Whether the first plan is known to be one through a graph: by as few operators."""
        fewest = graph.depth[graph.goal_nodes[0]]
        return self._best is not None and len(self._best.edges) == fewest

    def _is_proven(self) -> bool:
        return self._best is not None and self._at_least >= self._best.predicted_steps

    def _prove(self, rollouts: int) -> bool:
        """Raise what is proven of any plan through the graph; whether it rose.

        It ends where the best plan is good enough.

        Args:
            rollouts: Number of roll-outs for all proofs, besides those of searches for plans.
        """
        if self._best is None:
            return False
        enough = math.ceil(self._best.predicted_steps / self._effort.within)
        before = self._at_least
        self._at_least = max(before, self._proof.by_search(rollouts, enough))
        return self._at_least > before

    def _result(
        self, graph: AbstractGraph | None, nodes: int = 0, edges: int = 0
    ) -> PlanningResult:
        assert self._best is not None
        sizes = (nodes, edges) if graph is None else (len(graph.nodes), len(graph.edges))
        simulated = self._whole_model.executed - self._simulated_before
        # A plan may be shorter than all of the graph: with more options, through one near plans.
        at_least = min(self._at_least, self._best.predicted_steps)
        return PlanningResult(self._best, *sizes, simulated, graph=graph, at_least=at_least)


def _nothing() -> None:
    """Nothing has failed."""
