# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of operators that the FF heuristic finds, rolled out one after the other (SLAP D.2)."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.failures import Failures
from slap_ros.planning.ff import find_operator_sequence
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult
from slap_ros.planning.problem import Problem
from slap_ros.relational import State


@dataclass(frozen=True)
class FFPlanner:
    """Greedy best-first search with the FF heuristic, then roll-outs (SLAP D.2).

    An edge that cannot be executed is forbidden and the search repeated.

    Args:
        problem: The model, and the ground operators with their options.
        max_attempts: Abstract plans tried.
    """

    problem: Problem
    max_attempts: int = 100

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`."""
        model = self.problem.model
        before, start = model.executed, model.space.abstract(state)
        grounds = self.problem.grounds
        forbidden: set[tuple[int, int]] = set()
        failures = Failures()
        for _ in range(self.max_attempts):
            try:
                sequence = find_operator_sequence(start, goal, grounds, forbidden)
            except UnsolvableError as error:
                why = failures.in_words() or self.problem.why_not(start, goal)
                raise UnsolvableError(f"{error}: {why}") from error
            edges, failed = self._refine(state, start, sequence, failures)
            if failed is None:
                return PlanningResult(
                    Plan(tuple(edges)),
                    len(sequence) + 1,
                    len(sequence),
                    model.executed - before,
                )
            forbidden.add(failed)
        raise PlanningLimitError(
            f"none of {self.max_attempts} abstract plans could be executed; raise max_attempts: "
            f"{failures.in_words()}"
        )

    def _refine(
        self, state: State, abstract: int, sequence: list[int], failures: Failures
    ) -> tuple[list[PlanEdge], tuple[int, int] | None]:
        """Roll the operators out one after the other; second, the one that failed."""
        edges: list[PlanEdge] = []
        for number in sequence:
            ground, option = self.problem.operators[number]
            expected = ground.apply(abstract)
            target = option.target(expected)
            rollout = self.problem.model.roll_out(option, state, target)
            failures.add(option, target, rollout)
            if not rollout.reached:
                return edges, (abstract, number)
            edges.append(PlanEdge(option, target, rollout.steps))
            state, abstract = rollout.final, expected
        return edges, None
