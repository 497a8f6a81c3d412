# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The summaries of experiments: one per approach, all over the same tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from statistics import fmean, stdev
from typing import Any

from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.statistics import Interval, ratio_interval, wilson_interval


@dataclass(frozen=True)
class Spread:
    """Mean and sample standard deviation over tasks."""

    mean: float
    sd: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """The spread of at least one value."""
        return cls(fmean(values), stdev(values) if len(values) > 1 else 0.0)


def format_spread(spread: Spread | None, digits: int) -> str:
    """Mean ± sample standard deviation with so many digits, for a table; a dash for None."""
    return "-" if spread is None else f"{spread.mean:.{digits}f} ± {spread.sd:.{digits}f}"


@dataclass(frozen=True)
class Summary:
    """The figures of an approach over all tasks of an experiment.

    Args:
        experiment: Experiment whose tasks are solved.
        approach: Name of the approach.
        success_rate: Share of the tasks that were solved.
        success_interval: 95 % interval of the success rate.
        at_step_limit: Number of tasks that were given up at their step limit.
        plan_length: Environment steps executed, over solved tasks; None where no task was solved.
        relative_length: Plan length over that of pure planning, on tasks that both solved; None
            where there are none.
        relative_interval: 95 % interval of the relative length, over tasks; None with fewer than
            two tasks.
        planning_seconds: Planning time per task, s.
        edges_rolled_out: Number of options simulated while planning, mean per task.
        shortcut_share: Share of the environment steps executed that shortcuts took.
    """

    experiment: Experiment
    approach: str
    success_rate: float
    success_interval: Interval
    at_step_limit: int
    plan_length: Spread | None
    relative_length: float | None
    relative_interval: Interval | None
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
            experiment: Experiment whose tasks are solved.
            approach: Name of the approach.
            trials: Trials of this approach.
            baseline: Trials of pure planning, in the same order.

        Returns:
            The summary.
        """
        lengths = [float(trial.plan_length) for trial in trials if trial.success]
        steps = sum(trial.plan_length for trial in trials)
        own, other = lengths_of_both(trials, baseline)
        return cls(
            experiment,
            approach,
            fmean(trial.success for trial in trials),
            wilson_interval(len(lengths), len(trials)),
            sum(trial.at_step_limit for trial in trials),
            Spread.of(lengths) if lengths else None,
            sum(own) / sum(other) if sum(other) else None,
            ratio_interval(own, other) if sum(other) else None,
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
        return self.as_json() | {
            "success_interval": asdict(self.success_interval),
            "at_step_limit": self.at_step_limit,
            "relative_interval": asdict(self.relative_interval) if self.relative_interval else None,
            "shortcut_share": self.shortcut_share,
        }


def lengths_of_both(
    trials: Sequence[Trial], baseline: Sequence[Trial]
) -> tuple[list[int], list[int]]:
    """Plan lengths of an approach and of the baseline, on tasks that both solved in some steps."""
    pairs = [
        (trial.plan_length, other.plan_length)
        for trial, other in zip(trials, baseline, strict=True)
        if trial.success and other.success and other.plan_length
    ]
    return [own for own, _ in pairs], [other for _, other in pairs]
