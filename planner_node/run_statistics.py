# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sums of a run of the planner, as the action's result has them."""

from __future__ import annotations

from dataclasses import dataclass

from slap_msgs.action import SolveTask

from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.plan import PlanningResult


@dataclass
class RunStatistics:
    """The sums of a run, and its first plan. Planning times are the events', as bags have them."""

    first_step: int
    plans: int = 0
    improved: int = 0  # plans that are a shorter rest of the one before
    planning_ns: int = 0
    edges_rolled_out: int = 0
    first: PlanningResult | None = None  # first plan that was made

    def add(self, planned: PlanningResult, planning_ns: int) -> None:
        """Add a plan that was made.

        Args:
            planned: Plan, with the effort of finding it.
            planning_ns: Time that planning took, ns.
        """
        self.planning_ns += planning_ns
        self.edges_rolled_out += planned.edges_rolled_out
        self.first = self.first or planned

    @property
    def replans(self) -> int:
        """Number of plans that replaced one that diverged."""
        return max(self.plans - self.improved - 1, 0)

    def improve(self, shorter: PlanningResult) -> None:
        """Add a plan that is a shorter rest of the one before."""
        self.plans += 1
        self.improved += 1
        self.edges_rolled_out += shorter.edges_rolled_out

    def result(self, last_step: int, outcome: OptionResult) -> SolveTask.Result:
        """The action's result."""
        return SolveTask.Result(
            success=outcome.reached,
            plan_length=last_step - self.first_step,
            replans=self.replans,
            planning_seconds=self.planning_ns / 1e9,
            edges_rolled_out=self.edges_rolled_out,
            bound=(self.first.bound if self.first is not None else None) or 0.0,
            error_code=int(outcome.code),
            error_msg=outcome.reason,
        )
