# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The summaries of experiments: one per approach, all over the same tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any

from slap_ros.evaluation.experiment import Experiment, Trial


@dataclass(frozen=True)
class Spread:
    """Mean and sample standard deviation over tasks."""

    mean: float
    sd: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """The spread of at least one value."""
        return cls(fmean(values), stdev(values) if len(values) > 1 else 0.0)


@dataclass(frozen=True)
class Summary:
    """The figures of an approach over all tasks of an experiment.

    Args:
        experiment: Which tasks.
        approach: Its name.
        success_rate: Share of tasks that were solved.
        plan_length: Environment steps executed, over solved tasks; None where there is none.
        relative_length: Plan length over that of pure planning, on tasks that both solved; None
            where there is none.
        planning_seconds: Per task, s.
        edges_rolled_out: Options simulated while planning, mean per task.
        shortcut_share: Share of the environment steps executed that shortcuts took.
    """

    experiment: Experiment
    approach: str
    success_rate: float
    plan_length: Spread | None
    relative_length: float | None
    planning_seconds: Spread
    edges_rolled_out: float
    shortcut_share: float

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        approach: str,
        trials: Sequence[Trial],
        baseline: Sequence[Trial],
    ) -> Summary:
        """Summarise an approach.

        Args:
            experiment: Which tasks.
            approach: Its name.
            trials: Of this approach.
            baseline: Of pure planning, in the same order.

        Returns:
            The summary.
        """
        lengths = [float(trial.plan_length) for trial in trials if trial.success]
        steps = sum(trial.plan_length for trial in trials)
        return cls(
            experiment,
            approach,
            fmean(trial.success for trial in trials),
            Spread.of(lengths) if lengths else None,
            _relative_length(trials, baseline),
            Spread.of([trial.planning_seconds for trial in trials]),
            fmean(trial.edges_rolled_out for trial in trials),
            sum(trial.shortcut_steps for trial in trials) / steps if steps else 0.0,
        )

    def as_json(self) -> dict[str, Any]:
        """The JSON object of ``slap evaluate --json``."""
        length = self.plan_length
        return {
            "domain": self.experiment.domain.name,
            "preset": self.experiment.domain.preset,
            "approach": self.approach,
            "tasks": self.experiment.tasks,
            "seeds": self.experiment.seeds,
            "success_rate": self.success_rate,
            "plan_length": {
                "mean": length.mean if length else None,
                "sd": length.sd if length else None,
            },
            "relative_length": self.relative_length,
            "planning_seconds": {
                "mean": self.planning_seconds.mean,
                "sd": self.planning_seconds.sd,
            },
            "edges_rolled_out": {"mean": self.edges_rolled_out},
        }

    def as_row(self) -> dict[str, Any]:
        """The JSON object of one of several approaches."""
        return self.as_json() | {"shortcut_share": self.shortcut_share}


def _relative_length(trials: Sequence[Trial], baseline: Sequence[Trial]) -> float | None:
    """Mean length over that of pure planning, on the tasks that both solved."""
    pairs = [
        (trial.plan_length, other.plan_length)
        for trial, other in zip(trials, baseline, strict=True)
        if trial.success and other.success
    ]
    own, other = (sum(lengths) for lengths in zip(*pairs, strict=True)) if pairs else (0, 0)
    return own / other if other else None
