# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP on the same tasks: what most studies rest on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol, TypeVar

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import Approach
from slap_ros.evaluation.experiment import Experiment, Trial, run_all
from slap_ros.evaluation.summary import Spread, Summary
from slap_ros.shortcuts.workers import local_workers

Outcome = TypeVar("Outcome")


class Audience(Protocol):
    """Is told how a study goes."""

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        ...

    def done(self) -> None:
        """One of them is done."""
        ...

    def failed(self, complaint: str) -> None:
        """A task was not solved, and why."""
        ...


@dataclass(frozen=True)
class Measured:
    """One approach on all tasks of an experiment."""

    summary: Summary
    trials: tuple[Trial, ...]  # by seed and index

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return {**self.summary.as_row(), "trials": [asdict(trial) for trial in self.trials]}


@dataclass(frozen=True)
class Comparison:
    """What is compared, and on which tasks.

    Args:
        domain: Whose tasks.
        approaches: Ways to plan, pure planning first.
        tasks: How many of each seed.
        seeds: How many, from 0 on.
        jobs: Processes.
        planner: By name.
    """

    domain: Domain
    approaches: tuple[Approach, ...]
    tasks: int
    seeds: int
    jobs: int = 1
    planner: str = "lazy"

    def under(self, preset: str) -> Comparison:
        """The same under another preset.

        Raises:
            InvalidParameterError: The domain has no such preset or setting.
        """
        return replace(self, domain=get_domain(self.domain.name, preset))

    @property
    def experiment(self) -> Experiment:
        """Which tasks."""
        return Experiment(self.domain, self.tasks, self.seeds, planner=self.planner)

    def measure(self, audience: Audience) -> tuple[Measured, ...]:
        """Solve every task in every way; one that is not solved counts as failed."""
        experiment = self.experiment
        measured: list[Measured] = []
        audience.begin(self.domain.preset, len(experiment) * len(self.approaches))
        for approach in self.approaches:
            trials = []
            for trial in run_all(experiment, approach, self.jobs):
                trials.append(trial)
                audience.done()
                if not trial.success:
                    audience.failed(complaint(approach, trial.seed, trial.index, trial.reason))
            trials.sort(key=lambda trial: (trial.seed, trial.index))
            yardstick = measured[0].trials if measured else trials
            summary = Summary.of(experiment, approach.name, trials, yardstick)
            measured.append(Measured(summary, tuple(trials)))
        return tuple(measured)

    def each(
        self, function: Callable[..., Outcome], approach: Approach, jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Outcome]]:
        """Number and outcome of each job, as they end.

        Every job is given what makes domain and planner anew, then its own arguments. Every
        approach has processes of its own, as in :func:`run_all`.
        """
        common = (self.domain.name, self.domain.preset, self.planner, approach)
        with local_workers(self.jobs) as workers:
            yield from workers.run(function, [(*common, *job) for job in jobs])


def complaint(approach: Approach, seed: int, index: int, reason: str) -> str:
    """A task that was not solved, in words."""
    return f"{approach.name}: seed {seed}, task {index} not solved: {reason}"


def spread_of(values: Sequence[float]) -> Spread | None:
    """The spread of values, if there are any."""
    return Spread.of(values) if values else None


def said(spread: Spread | None, digits: int) -> str:
    """Mean ± sample standard deviation, for a table."""
    return "-" if spread is None else f"{spread.mean:.{digits}f} ± {spread.sd:.{digits}f}"
