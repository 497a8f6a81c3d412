# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sums of a run of the planner, as the action's result has them."""

from __future__ import annotations

from dataclasses import dataclass

from slap_msgs.action import SolveTask

from slap_ros.planning.options import OptionResult


@dataclass
class RunStatistics:
    """The sums of a run. Planning times are the events', so that a bag has them too."""

    first_step: int
    plans: int = 0
    planning_ns: int = 0
    edges_rolled_out: int = 0

    def result(self, last_step: int, outcome: OptionResult) -> SolveTask.Result:
        """The action's result."""
        return SolveTask.Result(
            success=outcome.reached,
            plan_length=last_step - self.first_step,
            replans=max(self.plans - 1, 0),
            planning_seconds=self.planning_ns / 1e9,
            edges_rolled_out=self.edges_rolled_out,
            error_code=int(outcome.code),
            error_msg=outcome.reason,
        )
