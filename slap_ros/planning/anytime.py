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

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace

from slap_ros.errors import InvalidStateError, PlanningLimitError, UnsolvableError
from slap_ros.planning.effort import Effort
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.planning.plan_improvement import PlanImprovement
from slap_ros.planning.problem import Problem
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.relational import State


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
        abstract, operators = self.problem.model.space.abstract(state), self.problem.operators
        planner = replace(self._whole, max_nodes=self.effort.abstract_states(len(operators)))
        run = PlanImprovement(self.problem, self.shortcuts, self.effort, state, goal, known)
        try:
            graph = planner.graph(abstract, goal)
        except PlanningLimitError:
            self.problem.require_reachable(abstract, goal)
            yield from run.near_plans(abstract)
        else:
            yield from run.through(graph, planner.add_shortcuts)
