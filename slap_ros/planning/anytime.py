# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A first plan soon, then better ones, and how far from the best they can be.

A small abstract graph is searched as ``lazy`` does. In a larger one, the first plan is the one that
the FF heuristic finds. Then the graph is searched as ``lazy`` does for a few roll-outs, which are
enough where a shortcut leads almost to the goal, and with falling weights (as in Richter, Thayer
and Ruml: The Joy of Forgetting: Faster Anytime Search via Restarting, ICAPS 2010): every search
begins anew, but roll-outs are kept, so that it pays for what is new alone. The last one, without a
weight, is the search of ``lazy``, and finds a plan of the same cost.

Where there are too many abstract states, the graph near the best plan is searched
(:mod:`slap_ros.planning.corridor`), shortcuts included, until that finds nothing shorter. Such a
graph is another one for each plan, so that less effort goes into it. It proves nothing of other
plans: :mod:`slap_ros.planning.plan_proof` does.

The effort is limited in roll-outs and abstract states, never in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace

from slap_ros.errors import InvalidStateError, PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.corridor import CorridorBuilder
from slap_ros.planning.effort import Effort
from slap_ros.planning.ff_planner import FFPlanner
from slap_ros.planning.graph_planner import GraphPlanner
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


class PlanningInterrupted(KeyboardInterrupt):
    """Planning was interrupted when it had a plan.

    Args:
        best: Best plan so far.
        interrupt: Interrupt that came.
    """

    def __init__(self, best: PlanningResult, interrupt: KeyboardInterrupt) -> None:
        super().__init__()
        self.best, self.interrupt = best, interrupt


@dataclass(frozen=True)
class AnytimePlanner:
    """Plans of any length soon, and of least cost where the effort suffices; see the module.

    Args:
        problem: The model, and the ground operators with their options.
        shortcuts: Where shortcut edges come from; None for pure planning.
        effort: How much planning may cost.
    """

    problem: Problem
    shortcuts: ShortcutSource | None = None
    effort: Effort = field(default_factory=Effort)

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`.

        Raises:
            PlanningInterrupted: An interrupt came when there was a plan.
        """
        best, before = None, self.problem.model.executed
        try:
            for best in self.improve(state, goal):
                if self._is_good(best):
                    break
        except KeyboardInterrupt as interrupt:
            if best is None:
                raise
            raise PlanningInterrupted(best, interrupt) from interrupt
        except UnsolvableError:  # as far as operators say
            if (unforeseen := self._whole.past_unforeseen(state, goal)) is None:
                raise
            return unforeseen
        if best is not None:
            return best
        result = self._whole.plan(state, goal)
        return replace(result, edges_rolled_out=self.problem.model.executed - before)

    @property
    def _whole(self) -> GraphPlanner:
        """The planner that searches the whole graph."""
        return GraphPlanner(self.problem, shortcuts=self.shortcuts)

    @property
    def _most_abstract_states(self) -> int:
        """Abstract states of a graph that is searched as a whole."""
        return self.effort.tests // max(1, len(self.problem.operators))

    def improve_rest(
        self, planned: PlanningResult, number: int, state: State, goal: int
    ) -> PlanningResult | None:
        """See :class:`~slap_ros.planning.planner.ImprovingPlanner`."""
        done, edge = planned.plan.edges[:number], planned.plan.edges[number]
        rest = Plan(planned.plan.edges[number + 1 :])
        if not (rest.edges and self.effort.improve) or self._is_good(planned):
            return None
        try:
            ahead = self.problem.model.roll_out(edge.option, state, edge.target)
        except InvalidStateError:  # as it is perceived, with noise, the model cannot be in it
            return None
        if not ahead.reached:
            return None
        effort = replace(self.effort, rollouts=self.effort.improve * max(1, ahead.steps))
        # With what is done, the rest is a plan too, and takes what any plan does.
        taken = Plan(done).predicted_steps + ahead.steps
        known = replace(planned, plan=rest, at_least=max(0, planned.at_least - taken))
        found: list[PlanningResult] = []
        with suppress(UnsolvableError, PlanningLimitError):  # of another plan than the rest
            found.extend(replace(self, effort=effort).improve(ahead.final, goal, known))
        if not found or found[-1].steps >= rest.predicted_steps:
            return None
        return replace(found[-1], origin=planned.origin)

    def _is_good(self, planned: PlanningResult) -> bool:
        return planned.bound is not None and planned.bound <= self.effort.within

    def improve(
        self, state: State, goal: int, known: PlanningResult | None = None
    ) -> Iterator[PlanningResult]:
        """Each plan that is better than those before, or of which more is proven.

        Args:
            state: Low-level state to start from.
            goal: Mask of atoms that must hold.
            known: Plan from there with what is proven, in the place of a first one and of proofs;
                None without one.

        Returns:
            The plans, as they are found; none where no plan through the abstract graph can be
            executed.

        Raises:
            UnsolvableError: No operators lead to the goal.
            PlanningLimitError: No plan was found within the limits.
        """
        abstract = self.problem.model.space.abstract(state)
        planner = replace(self._whole, max_nodes=self._most_abstract_states)
        run = _Improvement(self, state, goal, known)
        try:
            graph = planner.graph(abstract, goal)
        except PlanningLimitError:
            self.problem.require_reachable(abstract, goal)
            yield from run.near_plans(abstract)
        else:
            yield from run.through(graph, planner.add_shortcuts)


class _Improvement:
    """One run of :meth:`AnytimePlanner.improve`."""

    def __init__(
        self, planner: AnytimePlanner, state: State, goal: int, known: PlanningResult | None
    ) -> None:
        self._planner, self._state, self._goal = planner, state, goal
        self._simulated_before = planner.problem.model.executed
        self._model = CountedModel(planner.problem.model)
        self._problem = replace(planner.problem, model=self._model)
        self._limit = planner.effort.rollouts
        self._best = None if known is None else known.plan
        self._no_first: PlanningLimitError | None = None  # why FF found no plan
        self._at_least = 0 if known is None else known.at_least  # environment steps of any plan
        shortcuts, most = planner.shortcuts, planner._most_abstract_states // PROOFS
        self._proof = PlanProof(planner.problem, shortcuts, state, goal, most)
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
            self._limit = self._model.executed + self._planner.effort.rollouts // NEAR_PLANS
        yield from self._around(abstract)
        if self._best is None:
            self._find_first()

    def _around(self, abstract: int) -> Iterator[PlanningResult]:
        """Search near the start, where shortcuts pay most, then near each plan that is better."""
        operators, shortcuts = self._problem.operators, self._planner.shortcuts
        builder = CorridorBuilder(self._goal, operators, shortcuts)
        route: list[int] = [abstract]
        searched: Plan | None = None
        while True:
            graph = builder.around(route)
            ahead = LookAhead.of(graph)
            for weight in WEIGHTS:
                if self._take(self._search(graph, ahead, weight).plan):
                    yield self._result(graph)
            if self._is_proving and self._prove(self._planner.effort.rollouts // PROOFS):
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
        enough = math.ceil(self._best.predicted_steps / self._planner.effort.within)
        before = self._at_least
        self._at_least = max(before, self._proof.by_search(rollouts, enough))
        return self._at_least > before

    def _result(
        self, graph: AbstractGraph | None, nodes: int = 0, edges: int = 0
    ) -> PlanningResult:
        assert self._best is not None
        sizes = (nodes, edges) if graph is None else (len(graph.nodes), len(graph.edges))
        simulated = self._planner.problem.model.executed - self._simulated_before
        # A plan may be shorter than all of the graph: with more options, through one near plans.
        at_least = min(self._at_least, self._best.predicted_steps)
        return PlanningResult(self._best, *sizes, simulated, graph=graph, at_least=at_least)


def _nothing() -> None:
    """Nothing has failed."""
