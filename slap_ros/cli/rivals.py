# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The option ``--against`` of ``slap evaluate``: baselines beside planning, on the same tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console, styled
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.summary import Summary

if TYPE_CHECKING:
    from slap_ros.baselines.trials import Rival
    from slap_ros.core import Domain

Against = Annotated[
    list[str] | None,
    typer.Option(
        metavar="skills|FOLDER|MODULE:FUNCTION",
        help="What to compare with: skills, for the acquired skills that the shortcuts were "
        "learned over, alone; the folder of a baseline that `slap baseline train` made; or a "
        "function that returns a policy with predict(observation). May be repeated.",
    ),
]


@dataclass
class RivalResults:
    """What came of the baselines.

    Args:
        baselines: Those that can be used, by name.
        results: Summary and trials of each.
        described: What a file of results says of them; empty where there are none.
        refused: Number of folders that could not be used.
    """

    baselines: Mapping[str, Rival] = field(default_factory=dict)
    results: list[tuple[Summary, list[Trial]]] = field(default_factory=list)
    described: dict[str, Any] = field(default_factory=dict)
    refused: int = 0

    def complain(self, reason: str) -> None:
        """Say why a folder cannot be used; the others are."""
        self.refused += 1
        console.print(styled("error", "bold red", f" {reason}"))

    @property
    def exit_code(self) -> int:
        """The code of a command that has to do without some of them."""
        return int(ErrorCode.INVALID_LIBRARY if self.refused else ErrorCode.NONE)


def open_chosen_rivals(rivals: Sequence[str], domain: Domain) -> RivalResults:
    """Open the rivals before anything is planned, and say which cannot be used.

    Args:
        rivals: Folders of baselines, and policies as ``module:function``.
        domain: Domain that they must be of.

    Returns:
        Those that can be used, without results so far.
    """
    found = RivalResults()
    if rivals:
        from slap_ros.api.baselines import open_rivals

        found.baselines = open_rivals(rivals, domain, found.complain)
    return found


def run_rivals(
    experiment: Experiment, found: RivalResults, yardstick: Sequence[Trial], jobs: int
) -> None:
    """Let each rival act in every task.

    Args:
        experiment: Tasks to solve.
        found: Rivals that were opened, which receives their results.
        yardstick: Trials of pure planning on the same tasks.
        jobs: Number of processes.
    """
    if not found.baselines:
        return
    from slap_ros.api.baselines import describe_rival, run_baseline

    with counting_bars() as bar:
        total = len(experiment) * len(found.baselines)
        watched = bar.add_task("baselines", total=total)
        for name, baseline in found.baselines.items():
            try:
                trials = run_baseline(experiment, baseline, jobs, lambda _: bar.advance(watched))
            except SlapError as error:
                found.complain(str(error) if name in str(error) else f"{name}: {error}")
                continue
            found.results.append((Summary.of(experiment, name, trials, yardstick), trials))
            found.described.setdefault("against", {})[name] = describe_rival(baseline)
            for reason, count in _reasons(trials).items():
                console.print(f"{name}: {count} of {len(trials)} tasks not solved: {reason}")


def _reasons(trials: Sequence[Trial]) -> dict[str, int]:
    """How many tasks were not solved for each reason."""
    reasons = [trial.reason for trial in trials if not trial.success]
    return {reason: reasons.count(reason) for reason in dict.fromkeys(reasons)}
