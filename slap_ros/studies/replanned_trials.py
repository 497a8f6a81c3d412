# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success, length and replans of trials in which the planner may plan again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread
from slap_ros.studies.comparison import spread_of


class ReplannedTrial(Protocol):
    """What came of one task."""

    @property
    def success(self) -> bool:
        """Whether the task was solved."""
        ...

    @property
    def plan_length(self) -> int:
        """Number of environment steps executed."""
        ...

    @property
    def replans(self) -> int:
        """Number of plans that were looked for after the first."""
        ...


@dataclass(frozen=True)
class ReplannedTrials:
    """What came of several tasks.

    Args:
        trials: What came of each, one at least.
    """

    trials: Sequence[ReplannedTrial]

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks that were solved."""
        return SuccessRate(sum(one.success for one in self.trials), len(self.trials))

    @property
    def length(self) -> Spread | None:
        """The number of environment steps, over solved tasks; None without any."""
        return spread_of([float(one.plan_length) for one in self.trials if one.success])

    @property
    def replans(self) -> Spread:
        """The number of replans, over all tasks."""
        return Spread.of([float(one.replans) for one in self.trials])

    def as_json(self) -> dict[str, Any]:
        """The figures, for a report's JSON."""
        return {
            "success_rate": self.solved.share,
            "success_interval": asdict(self.solved.interval),
            "plan_length": asdict(self.length) if self.length else None,
            "replans": asdict(self.replans),
        }
