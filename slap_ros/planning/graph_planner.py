# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans through the abstract planning graph, shortcuts among its edges (SLAP §4.1, Alg. 2)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import MAX_NODES, AbstractGraph, build_abstract_graph
from slap_ros.planning.graph_beyond import add_beyond
from slap_ros.planning.lazy_search import SearchLimits, search_lazily
from slap_ros.planning.model import Model
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.planning.problem import Problem
from slap_ros.planning.recovery import Recovery
from slap_ros.planning.search import SearchOutcome
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.planning.unforeseen import UnforeseenSearch
from slap_ros.relational import State

Search = Callable[[AbstractGraph, State, Model], SearchOutcome]

# The last resort, where nothing else has a plan: a tower beside a target is taken down first.
DEEPEST = 6  # layers after the first with a goal state
MOST_DEEP_NODES = 5_000  # abstract states of it
MOST_DEEP_ROLLOUTS = 100  # of options that the model tries


@dataclass(frozen=True)
class GraphPlanner:
    """The abstract planning graph, then a shortest path through it (SLAP §4.1, Alg. 2).

    Shortcuts are edges like others: one that fails in the model leads nowhere, and without any
    this is pure planning. One of which no edge is on a way to the goal may lead out of the graph
    (:func:`~slap_ros.planning.graph_beyond.add_beyond`). Where no path can be executed, the
    graph is deepened beyond the paper's: by one layer at a time, up to ``max_extra_depth``.

    In the same graph, a plan with shortcuts is never longer in the model than one without; see
    :mod:`slap_ros.planning.search`. A plan that shortcuts make possible in a shallower graph is
    taken, though a deeper one might have a shorter plan.

    Where skills fail on every path, see :mod:`slap_ros.planning.recovery`; where no operators lead
    to the goal, :mod:`slap_ros.planning.unforeseen`. Where that has no plan either, the graph is
    deepened much further, within a limited effort.

    Args:
        problem: The model, and the ground operators with their options.
        search: Lazy or exhaustive.
        max_extra_depth: Layers, one per operator, by which the graph may be deepened, and operators
            of a detour.
        shortcuts: Where shortcut edges come from.
        max_nodes: Abstract states of a graph after which to give up.
    """

    problem: Problem
    search: Search = search_lazily
    max_extra_depth: int = 2
    shortcuts: ShortcutSource | None = None
    max_nodes: int = MAX_NODES

    def __post_init__(self) -> None:
        if self.max_extra_depth < 0:
            raise InvalidParameterError(f"max_extra_depth must not be negative: {self}")

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`."""
        before, remark = self.problem.model.executed, ""
        try:
            graph, outcome = self.search_to(state, goal)
        except UnsolvableError:
            if (unforeseen := self.past_unforeseen(state, goal)) is None:
                raise
            return unforeseen
        plan = outcome.plan
        if plan is None:
            recovery = Recovery(self.problem, graph, state, goal, outcome.failed)
            if self.problem.exact:
                if (plan := recovery.past_side_effect(self.search_to)) is None:
                    graph, outcome = self._search_deeper(state, goal, graph, outcome)
                    plan = outcome.plan
            elif (plan := recovery.detour(self.max_extra_depth)) is None:
                plan, remark = recovery.despite_failures(), outcome.reason
            if plan is None:
                raise UnsolvableError(outcome.reason)
        result = self._result(plan, graph, before)
        return replace(result, fails=remark, at_least=outcome.at_least or 0)

    def _result(self, plan: Plan, graph: AbstractGraph, before: int) -> PlanningResult:
        """A plan through a graph, for which the model had rolled out so many options before."""
        rolled_out = self.problem.model.executed - before
        return PlanningResult(plan, len(graph.nodes), len(graph.edges), rolled_out, graph=graph)

    def _search_deeper(
        self, state: State, goal: int, graph: AbstractGraph, outcome: SearchOutcome
    ) -> tuple[AbstractGraph, SearchOutcome]:
        """What a much deeper search comes to; graph and outcome as before without a plan."""
        with suppress(PlanningLimitError):
            deeper, found = self.deepened().search_to(state, goal)
            if found.plan is not None:
                return deeper, found
        return graph, outcome

    def deepened(self) -> GraphPlanner:
        """The same with a graph that may be much deeper, and a limited effort."""
        limits = SearchLimits(rollouts=self.problem.model.executed + MOST_DEEP_ROLLOUTS)
        return replace(
            self,
            search=partial(search_lazily, limits=limits),
            max_extra_depth=max(DEEPEST, self.max_extra_depth),
            max_nodes=min(MOST_DEEP_NODES, self.max_nodes),
        )

    def past_unforeseen(self, state: State, goal: int) -> PlanningResult | None:
        """A plan from where no operators lead to the goal; None if none is found.

        With acquired skills, it is looked for from measured states alone: a robot may stop
        anywhere. In the planner's own world, only plans that are known to fail end there.

        Args:
            state: Low-level state to start from.
            goal: Mask of atoms that must hold.
        """
        before = self.problem.model.executed
        if not (self.problem.exact or self.problem.measured):
            return None
        for planner in (self, self.deepened()):
            found = UnforeseenSearch(self.problem, goal, planner.search_to).plan(state)
            if found is not None:
                return self._result(*found, before)
        return None

    def search_to(self, state: State, goal: int) -> tuple[AbstractGraph, SearchOutcome]:
        """Search the shallowest graph in which there is a plan, else the deepest one.

        Args:
            state: Low-level state to start from.
            goal: Mask of atoms that must hold.

        Returns:
            The graph, and what the search in it came to.

        Raises:
            UnsolvableError: No operators lead to the goal.
            PlanningLimitError: There are too many abstract states.
        """
        start = self.problem.model.space.abstract(state)
        for extra_depth in range(self.max_extra_depth + 1):
            graph = self.graph(start, goal, extra_depth)
            self.add_shortcuts(graph)
            outcome = self.search(graph, state, self.problem.model)
            if outcome.plan is not None:
                break
        return graph, outcome

    def graph(self, start: int, goal: int, extra_depth: int = 0) -> AbstractGraph:
        """The top level, still without shortcuts.

        Args:
            start: Abstract state to start from, a mask.
            goal: Mask of atoms that must hold.
            extra_depth: Layers after the first with a goal state.

        Raises:
            UnsolvableError: No operators lead to the goal; which atoms of it cannot be had.
            PlanningLimitError: More than ``max_nodes`` abstract states.
        """
        operators = self.problem.operators
        try:
            graph = build_abstract_graph(start, goal, operators, extra_depth, self.max_nodes)
        except UnsolvableError as error:
            raise UnsolvableError(f"{error}: {self.problem.why_not(start, goal)}") from error
        graph.space = self.problem.model.space
        return graph

    def add_shortcuts(self, graph: AbstractGraph) -> None:
        """Add shortcuts to a graph, and what they alone lead to."""
        if self.shortcuts is not None:
            shortcuts, on_way = self.shortcuts.edges(graph), graph.on_way_to_goal()
            within = {edge.option.skill.name for edge in shortcuts if edge.target in on_way}
            add_beyond(graph, self.shortcuts.beyond(graph, within), self.problem.operators)
            graph.edges.extend(shortcuts)
