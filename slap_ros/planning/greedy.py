# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Greedy best-first search on ground PDDL tasks, with deferred evaluation and preferred operators.

Two queues take turns: one has all successors of the states seen, the other those that helpful
actions lead to, which is asked more often after progress (Richter and Helmert, "Preferred operators
and deferred evaluation in satisficing planning", ICAPS 2009). A state is evaluated when it leaves a
queue, where it waits with the estimate of the state before it.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field

import numpy as np

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.additive import relaxed_plan
from slap_ros.planning.arrivals import trace
from slap_ros.planning.relaxation import Indices, RelaxedTask
from slap_ros.relational.pddl.ground_task import GroundTask

MAX_EXPANSIONS = 1_000_000  # abstract states
MAX_TESTS = 10_000_000_000  # of operators, once per round of the heuristic; some minutes
BOOST = 1000  # expansions of successors by helpful actions after progress


def find_plan(task: GroundTask, effort: int = 1) -> list[int]:
    """A plan for a ground task, which need be neither the shortest nor the cheapest.

    The same arguments give the same plan.

    Args:
        task: Task to be solved.
        effort: Factor of the limits of the search.

    Returns:
        Indices of actions; none where the goal holds already.

    Raises:
        UnsolvableError: There is no plan.
        PlanningLimitError: None was found within the limits.
    """
    if task.start & task.goal == task.goal:
        return []
    return _Search(task, effort * MAX_EXPANSIONS, effort * MAX_TESTS).run()


@dataclass(order=True)
class _Successors:
    """Successors of one state that have not been looked at; the same estimate for all of them."""

    estimate: float
    number: int  # order of expansion
    state: int = field(compare=False)
    actions: Indices = field(compare=False)
    following: int = field(default=0, compare=False)  # which of the actions is next


class _Queue:
    """Successors, those with the least estimate first, then those that were found first."""

    def __init__(self) -> None:
        self._heap: list[_Successors] = []
        self.turns = 0  # the queue with the fewest is asked next

    def __bool__(self) -> bool:
        return bool(self._heap)

    def push(self, successors: _Successors) -> None:
        """Add the successors of a state."""
        if len(successors.actions):
            heapq.heappush(self._heap, successors)

    def pop(self) -> tuple[int, int]:
        """The next state, and the index of the action to be applied."""
        first = self._heap[0]
        action = int(first.actions[first.following])
        first.following += 1
        if first.following == len(first.actions):
            heapq.heappop(self._heap)
        return first.state, action


class _Search:
    """One run of :func:`find_plan`."""

    def __init__(self, task: GroundTask, max_expansions: int, max_tests: int) -> None:
        self._task = task
        self._limits = max_expansions, max_tests
        # Unit costs: what is near is found sooner than what is cheap.
        self._relaxed = RelaxedTask(task, [1.0] * len(task.actions))
        self._arrivals: dict[int, tuple[int, int]] = {}  # previous state, action
        self._all, self._helpful = _Queue(), _Queue()
        self._best = np.inf
        self._expansions = 0

    def run(self) -> list[int]:
        """Until the goal is reached."""
        start = self._task.start
        self._arrivals[start] = start, -1
        if not self._expand(start):
            raise UnsolvableError("the goal is out of reach, even if operators deleted nothing")
        while self._all or self._helpful:
            queue = self._next_queue()
            queue.turns += 1
            state, index = queue.pop()
            successor = self._task.apply(self._task.actions[index], state)
            if successor in self._arrivals:
                continue
            self._arrivals[successor] = state, index
            if successor & self._task.goal == self._task.goal:
                return trace(self._arrivals, start, successor)
            self._check_limits()
            self._expand(successor)
        raise UnsolvableError(
            f"none of the {len(self._arrivals)} abstract states that can be reached leads to the "
            "goal"
        )

    def _next_queue(self) -> _Queue:
        if not (self._all and self._helpful):
            return self._all or self._helpful
        return min(self._helpful, self._all, key=lambda queue: queue.turns)

    def _expand(self, state: int) -> bool:
        """Add the successors of a state; False where it leads nowhere."""
        self._expansions += 1
        truth = self._relaxed.truth(state)
        plan = relaxed_plan(self._relaxed, truth)
        if plan is None:
            return False
        if plan.cost < self._best:
            self._helpful.turns -= BOOST if np.isfinite(self._best) else 0
            self._best = plan.cost
        found = plan.cost, self._expansions, state
        self._all.push(_Successors(*found, self._relaxed.applicable(truth)))
        self._helpful.push(_Successors(*found, plan.helpful))
        return True

    def _check_limits(self) -> None:
        max_expansions, max_tests = self._limits
        if self._expansions >= max_expansions:
            raise PlanningLimitError(
                f"no plan within {max_expansions} expansions of abstract states; raise the limit "
                "or give a goal nearer by"
            )
        if self._relaxed.tests > max_tests:
            raise PlanningLimitError(
                f"no plan after {max_tests} tests of operators, in {self._expansions} expansions "
                "of abstract states; raise the limit or give a goal nearer by"
            )
