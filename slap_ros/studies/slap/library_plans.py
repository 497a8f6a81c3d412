# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What plans are worth with a part of a library, or with shortcuts that are not learned yet."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from slap_ros.evaluation.experiment import Trial
from slap_ros.evaluation.statistics import ratio_interval
from slap_ros.evaluation.summary import Spread, format_spread, lengths_of_both
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.studies.comparison import Comparison, named_tasks, solve_task, spread_of


@dataclass(frozen=True)
class LibraryPlans:
    """Executed plans with some shortcuts.

    Args:
        shortcuts: Names of the shortcuts.
        trials: Trials with the shortcuts, by seed and index.
        baseline: Trials of the same tasks with pure planning.
    """

    shortcuts: tuple[str, ...]
    trials: tuple[Trial, ...]
    baseline: tuple[Trial, ...]

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the shortcuts that a plan had, and that reached their targets."""
        found = {edge.option for trial in self.trials for edge in trial.edges if edge.reached}
        return tuple(name for name in self.shortcuts if name in found)

    @property
    def length(self) -> Spread | None:
        """Environment steps of solved tasks; None where none was solved."""
        return spread_of([float(trial.plan_length) for trial in self.trials if trial.success])

    @property
    def relative(self) -> float | None:
        """Length relative to pure planning, on tasks that both solved; None without any."""
        own, other = lengths_of_both(self.trials, self.baseline)
        return sum(own) / sum(other) if other else None

    def summary(self) -> dict[str, Any]:
        """All but the trials, for the report's JSON."""
        own, other = lengths_of_both(self.trials, self.baseline)
        interval = ratio_interval(own, other) if other else None
        return {
            "shortcuts": list(self.shortcuts),
            "success_rate": sum(trial.success for trial in self.trials) / len(self.trials),
            "plan_length": asdict(self.length) if self.length else None,
            "relative_length": self.relative,
            "relative_interval": asdict(interval) if interval else None,
        }

    def as_json(self) -> dict[str, Any]:
        """The summary and every trial, for the report's JSON."""
        return {**self.summary(), "trials": [trial.as_json() for trial in self.trials]}

    def as_cells(self) -> list[str]:
        """The cells of a table's row."""
        relative = "-" if self.relative is None else f"{self.relative:.2f}"
        return [str(len(self.shortcuts)), format_spread(self.length, 1), relative]


def plan_with(
    comparison: Comparison, shortcuts: tuple[Shortcut, ...], what: str
) -> tuple[Trial, ...]:
    """Solve tasks with other shortcuts than those of a comparison.

    Args:
        comparison: Comparison of pure planning with SLAP, and its tasks.
        shortcuts: Shortcuts in place of the library's; none for pure planning.
        what: Name of the shortcuts; nothing else in the study has the same name.

    Returns:
        What came of each task, by seed and index.
    """
    pure, slap = comparison.approaches[0], comparison.approaches[-1]
    approach = replace(slap, shortcuts=shortcuts) if shortcuts else pure
    alone = replace(comparison, approaches=(approach,))
    jobs = named_tasks(comparison.experiment)
    (trials,) = alone.attempt(
        f"{comparison.domain.preset}, {what}", solve_task, Trial.from_json, jobs
    ).values()
    return trials
