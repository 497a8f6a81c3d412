# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of least cost for ground PDDL tasks, as far as that can be had.

A* with h_max (see :mod:`~.hmax`), whose costs are those of the actions, finds a cheapest plan and
proves that it is one. Where that takes too long, weighted A* (Pohl, "Heuristic search viewed as
path finding in a graph", Artificial Intelligence 1, 1970) with the FF heuristic finds cheaper plans
than the one at hand. Both leave out what is no cheaper than the best plan so far.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.additive import relaxed_plan
from slap_ros.planning.arrivals import trace
from slap_ros.planning.relaxation import RelaxedTask, Truth
from slap_ros.relational.pddl.ground_task import GroundTask

MAX_STATES = 200_000  # to be evaluated for a proof
MAX_TESTS = 10_000_000_000  # of operators, for a proof
STATES_TO_IMPROVE = 15_000  # to be evaluated by each search for a cheaper plan; some seconds
TESTS_TO_IMPROVE = 15_000_000
WEIGHT = 3.0  # of the heuristic of the first of them

Heuristic = Callable[[Truth], float | None]  # what it takes to reach the goal; None: impossible


@dataclass(frozen=True)
class CostlyPlan:
    """A plan and what is known of its cost.

    Args:
        actions: Indices of actions.
        cost: Sum of their costs.
        is_cheapest: Whether it is proven that no plan costs less.
    """

    actions: list[int]
    cost: float
    is_cheapest: bool


def cost_of(task: GroundTask, actions: list[int]) -> float:
    """What a plan costs."""
    return sum(task.actions[index].cost for index in actions)


def find_cheapest_plan(task: GroundTask, effort: int = 1) -> CostlyPlan:
    """A plan than which none costs less.

    Args:
        task: Task to be solved.
        effort: Factor of the limits of the search.

    Raises:
        UnsolvableError: There is no plan.
        PlanningLimitError: None was found within the limits.
    """
    limits = effort * MAX_STATES, effort * MAX_TESTS
    search = _CostSearch(task, *_h_max(task), 1.0, limits)
    if search.heuristic_of(task.start) is None:
        raise UnsolvableError("the goal is out of reach, even if operators deleted nothing")
    plan = search.run(np.inf)
    if plan is not None:
        return CostlyPlan(plan, cost_of(task, plan), True)
    if search.gave_up:
        raise PlanningLimitError(
            f"no plan of least cost within {search.evaluated} abstract states; raise the limit, or "
            "take the planner ff"
        )
    raise UnsolvableError(
        f"none of the {search.evaluated} abstract states that can be reached leads to the goal"
    )


def make_cheaper(task: GroundTask, actions: list[int], effort: int = 1) -> CostlyPlan:
    """A plan that costs less than a given one, where one is found.

    Args:
        task: Task to be solved.
        actions: Plan at hand.
        effort: Factor of the limits of the search.
    """
    limits = effort * STATES_TO_IMPROVE, effort * TESTS_TO_IMPROVE
    best = CostlyPlan(actions, cost_of(task, actions), not actions)
    for heuristic, weight in ((_ff, WEIGHT), (_h_max, 1.0)):
        search = _CostSearch(task, *heuristic(task), weight, limits)
        cheaper = search.run(best.cost)
        if cheaper is not None:
            best = CostlyPlan(cheaper, cost_of(task, cheaper), weight == 1.0)
        if best.is_cheapest or (cheaper is None and not search.gave_up):
            return CostlyPlan(best.actions, best.cost, True)
    return best


def _h_max(task: GroundTask) -> tuple[RelaxedTask, Heuristic]:
    relaxed = RelaxedTask(task, [action.cost for action in task.actions])

    def heuristic(truth: Truth) -> float | None:
        atoms, _ = relaxed.reach(truth, np.maximum)
        most = float(atoms[relaxed.goal].max(initial=0.0))
        return most if np.isfinite(most) else None

    return relaxed, heuristic


def _ff(task: GroundTask) -> tuple[RelaxedTask, Heuristic]:
    # One more for each action: where many cost nothing, the nearest goal is still preferred.
    relaxed = RelaxedTask(task, [action.cost + 1 for action in task.actions])

    def heuristic(truth: Truth) -> float | None:
        plan = relaxed_plan(relaxed, truth)
        return None if plan is None else plan.cost

    return relaxed, heuristic


class _CostSearch:
    """Weighted A*; with the weight 1 and an admissible heuristic, A*."""

    def __init__(
        self,
        task: GroundTask,
        relaxed: RelaxedTask,
        heuristic: Heuristic,
        weight: float,
        limits: tuple[int, int],
    ) -> None:
        """Prepare a search.

        Args:
            task: Task to be solved.
            relaxed: Task without deletes.
            heuristic: What it takes to reach the goal.
            weight: Factor of the heuristic.
            limits: Numbers of states and of tests after which to give up.
        """
        self._task, self._relaxed, self._weight = task, relaxed, weight
        self._heuristic = heuristic
        self._max_states, self._max_tests = limits
        self._known: dict[int, float | None] = {}  # heuristic of each state
        self.gave_up = False

    @property
    def evaluated(self) -> int:
        """Number of states that were evaluated."""
        return len(self._known)

    def heuristic_of(self, state: int) -> float | None:
        """What it takes from a state, which is evaluated once."""
        if state not in self._known:
            self._known[state] = self._heuristic(self._relaxed.truth(state))
        return self._known[state]

    def run(self, bound: float) -> list[int] | None:
        """A plan that costs less than a bound; None where there is none, or it gave up."""
        task, start = self._task, self._task.start
        costs: dict[int, float] = {start: 0}
        arrivals: dict[int, tuple[int, int]] = {}
        queue: list[tuple[float, float, int, float, int]] = [(0, 0, 0, 0, start)]
        order = 0
        while queue:
            *_, cost, state = heapq.heappop(queue)
            if state & task.goal == task.goal:
                return trace(arrivals, start, state)
            if cost > costs[state]:
                continue
            if self.evaluated >= self._max_states or self._relaxed.tests > self._max_tests:
                self.gave_up = True
                return None
            for index in self._relaxed.applicable(self._relaxed.truth(state)).tolist():
                successor = task.apply(task.actions[index], state)
                total = cost + task.actions[index].cost
                if total >= min(bound, costs.get(successor, np.inf)):
                    continue
                remaining = self.heuristic_of(successor)
                if remaining is None or (self._weight == 1.0 and total + remaining >= bound):
                    continue
                costs[successor], arrivals[successor] = total, (state, index)
                order += 1
                estimate = total + self._weight * remaining
                heapq.heappush(queue, (estimate, remaining, order, total, successor))
        return None
