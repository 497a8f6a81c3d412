# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap evaluate``."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from slap_ros.cli.console import Json, Planner, Preset, console, print_json, progress
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidLibraryError
from slap_ros.evaluation.experiment import Experiment, Spread, Summary
from slap_ros.planning.execution import Episode

NO_SHORTCUTS = "none"


def evaluate(
    domain: Annotated[str, typer.Argument(help="One of `slap domains`.")],
    tasks: Annotated[int, typer.Option(min=1, help="Tasks a seed.")] = 10,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds.")] = 5,
    first_seed: Annotated[int, typer.Option(min=0, help="The first seed.")] = 0,
    preset: Preset = "fair",
    shortcuts: Annotated[
        str | None,
        typer.Option(help="A shortcut library, or none. Default: the shipped one, if there is."),
    ] = None,
    planner: Planner = "lazy",
    json: Json = False,
) -> int:
    """Plan and execute many tasks in the world and sum up: success, plan length, planning time.

    Spreads are mean ± sample standard deviation over all tasks.
    """
    if shortcuts not in (None, NO_SHORTCUTS):
        raise InvalidLibraryError(
            f"{shortcuts}: this version of slap_ros has no shortcut libraries; use --shortcuts none"
        )
    experiment = Experiment(get_domain(domain, preset), tasks, seeds, first_seed, planner)
    summary = Summary.of_pure_planning(experiment, _run(experiment))
    if json:
        print_json(summary.as_json())
    else:
        console.print(_table(summary))
    return 0 if summary.success_rate == 1.0 else int(ErrorCode.UNKNOWN)


def _run(experiment: Experiment) -> list[Episode]:
    episodes = []
    with progress() as bar:
        for seed, index in bar.track(experiment, description=experiment.domain.name):
            episode = experiment.run(seed, index)
            episodes.append(episode)
            if not episode.success:
                console.print(f"seed {seed}, task {index} not solved: {episode.error.reason}")
    return episodes


def _table(summary: Summary) -> Table:
    experiment = summary.experiment
    table = Table(
        "approach",
        "success",
        "plan length [steps]",
        "relative length",
        "planning [s]",
        "edges rolled out",
        title=(
            f"{experiment.domain.name}, preset {experiment.domain.preset}: "
            f"{experiment.seeds} seeds from {experiment.first_seed} × {experiment.tasks} tasks"
        ),
    )
    table.add_row(
        summary.approach,
        f"{summary.success_rate:.0%}",
        _spread(summary.plan_length, 1),
        "-" if summary.relative_length is None else f"{summary.relative_length:.2f}",
        _spread(summary.planning_seconds, 3),
        f"{summary.edges_rolled_out:.1f}",
    )
    return table


def _spread(spread: Spread | None, digits: int) -> str:
    return "-" if spread is None else f"{spread.mean:.{digits}f} ± {spread.sd:.{digits}f}"
