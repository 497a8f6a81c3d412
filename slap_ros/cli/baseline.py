# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap baseline``: train learners of whole tasks for comparison, and list them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer
from rich.progress import BarColumn, TaskID, TimeRemainingColumn
from rich.table import Table

from slap_ros.api.command_options import DomainName, Preset
from slap_ros.baselines.method import BaselineProgress
from slap_ros.baselines.methods import METHODS
from slap_ros.cli.console import console, exits, print_json, print_result
from slap_ros.cli.learning_bars import LearningBars
from slap_ros.cli.options import Goal, Json, flat_options
from slap_ros.cli.skill_choice import open_chosen
from slap_ros.cli.training_options import TrainingSeed, WorkFolder, setting_changes
from slap_ros.skills.domain_choice import SHIPPED

BASELINES = Path("runs/baselines")

app = typer.Typer(
    help="Train learners of whole tasks for comparison: PPO, SAC, SAC with hindsight, and more.",
    no_args_is_help=True,
)


def _known(method: str) -> str:
    """A method's name, as it is."""
    if method not in METHODS:
        raise typer.BadParameter(f"unknown method {method!r}; there are {', '.join(METHODS)}")
    return method


def _matching(incomplete: str) -> list[str]:
    """The methods that a shell may complete a name to."""
    return [name for name in METHODS if name.startswith(incomplete)]


@dataclass(frozen=True)
class BaselineOptions:
    """What to train, how, and where to keep it."""

    method: Annotated[
        str,
        typer.Argument(
            help="Name of a method; `slap baseline list` lists them.",
            callback=_known,
            autocompletion=_matching,
        ),
    ]
    domain: DomainName
    output: Annotated[
        Path | None,
        typer.Option(help=f"Folder of the baseline. Default: {BASELINES}/DOMAIN-METHOD."),
    ] = None
    preset: Preset = None
    goal: Goal = None
    seed: TrainingSeed = 0
    settings: Annotated[
        str, typer.Option(help="Hyper-parameters: ours, or paper (SLAP's appendix; not for sac).")
    ] = "ours"
    set: Annotated[list[str] | None, setting_changes("n_envs=16")] = None
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps of the training. Default: as in the settings."),
    ] = None
    work: WorkFolder = None
    json: Json = False

    @property
    def folder(self) -> Path:
        """Where the baseline is saved."""
        return self.output or BASELINES / f"{self.domain}-{self.method}"


@app.command("train")
@exits
@flat_options
def train(options: BaselineOptions) -> int:
    """Train a learner of whole tasks, from -1 per step; `sac` from the stages of a plan.

    After an interruption, the same command goes on where it stopped. `slap evaluate DOMAIN
    --against FOLDER` puts it beside planning.
    """
    from slap_ros.api.baselines import train_baseline

    domain = open_chosen(options.domain, options.preset, SHIPPED)
    began = monotonic()
    with _BaselineBar(f"learning {options.method}") as bar:
        trained = train_baseline(
            options.method,
            domain,
            options.folder,
            seed=options.seed,
            goal=options.goal,
            settings=options.settings,
            changes=options.set or (),
            steps=options.steps,
            work=options.work,
            report=bar.show,
        )
    seconds = monotonic() - began
    if options.json:
        print_json({"baseline": str(options.folder), **trained.record, "seconds": seconds})
    console.print(
        f"{options.method} in {options.folder}, {seconds:.0f} s; compare it with `slap evaluate "
        f"{options.domain} --preset {domain.preset} --against {options.folder}`"
    )
    return 0


@app.command("list")
@exits
@flat_options
def list_methods(json: Json = False) -> int:
    """List the methods, each with what it is."""
    if json:
        print_json({name: entry.help for name, entry in METHODS.items()})
        return 0
    table = Table("method", "")
    for name, entry in METHODS.items():
        table.add_row(name, entry.help)
    print_result(table)
    return 0


class _BaselineBar(LearningBars):
    """How far a training is, and its newest figures."""

    def __init__(self, what: str) -> None:
        super().__init__(BarColumn(), TimeRemainingColumn())
        self._what = what
        self._bar: TaskID | None = None

    def show(self, progress: BaselineProgress) -> None:
        """Show the newest figures."""
        if self._bar is None:
            self._bar = self.bars.add_task(self._what, total=progress.total_steps, detail="")
        detail = f"{progress.episodes} episodes, success {progress.success:.0%}"
        self.bars.update(self._bar, completed=progress.steps, detail=detail)
