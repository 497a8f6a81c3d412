# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap train``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer
from rich.progress import BarColumn, TaskID, TimeRemainingColumn

from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.training import skills_option
from slap_ros.api.training import train as train_library
from slap_ros.cli.console import console, print_json
from slap_ros.cli.learning_bars import LearningBars
from slap_ros.cli.options import Json
from slap_ros.cli.skill_choice import Skills, open_chosen
from slap_ros.cli.training_options import (
    Ray,
    TrainingSeed,
    WorkFolder,
    new_library,
    setting_changes,
)
from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.progress import latest
from slap_ros.shortcuts.training_callback import TrainingCallback
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
from slap_ros.skills.domain_choice import SHIPPED

LIBRARIES = Path("runs/models")


@dataclass(frozen=True)
class TrainOptions:
    """What to train, how, and where to keep it."""

    domain: DomainName
    output: Annotated[Path | None, new_library(LIBRARIES)] = None
    preset: Preset = None
    skills: Skills = SHIPPED
    seed: TrainingSeed = 0
    settings: Annotated[
        str,
        typer.Option(
            help="Hyper-parameters: ours, ours_short (ends as soon as plans get no shorter), "
            "ours_several (more shortcuts, also for random goals), ours_near (explores with pushes "
            "at objects, and beyond what operators reach), ours_approaches (clones a push after a "
            "way round an object), ours_chains (clones two skills in a "
            "row, made shorter), ours_kept_chains (the same of skills and shortcuts of --keep), "
            "subgoals (one policy for several shortcuts), paper (the paper's), or the name of the "
            "domain's own."
        ),
    ] = "ours"
    keep: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Library of an earlier training, whose shortcuts are options like any other and "
            "become part of the new library.",
        ),
    ] = None
    set: Annotated[list[str] | None, setting_changes("exploration.rollouts=16")] = None
    steps: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Environment steps per shortcut, all stages together. Default: as in the "
            "settings.",
        ),
    ] = None
    jobs: Jobs = 2
    ray: Ray = None
    work: WorkFolder = None
    json: Json = False

    @property
    def library_folder(self) -> Path:
        """Where the library is saved."""
        return self.output or LIBRARIES / self.domain

    @property
    def skills_given(self) -> str:
        """The option ``--skills`` as a part of commands."""
        return skills_option(self.skills)


def train(options: TrainOptions) -> int:
    """Find and learn shortcuts: explore, rank, train, keep what makes plans shorter.

    After an interruption, the same command goes on where it stopped. The work folder has logs for
    TensorBoard.
    """
    domain = open_chosen(options.domain, options.preset, options.skills)
    began, folder = monotonic(), options.library_folder
    with _TrainingBars() as bars:
        library = train_library(
            domain,
            folder,
            seed=options.seed,
            settings=options.settings,
            changes=options.set or (),
            steps=options.steps,
            work=options.work,
            jobs=options.jobs,
            ray=options.ray,
            callback=bars,
            keep=options.keep,
        )
    seconds = monotonic() - began
    if options.json:
        print_json({"library": str(folder), **library.record, "seconds": seconds})
    console.print(
        f"{len(library.shortcuts)} shortcuts in {folder}, {seconds:.0f} s; see what they are worth "
        f"with `slap evaluate {options.domain}{options.skills_given} --shortcuts "
        f"{shlex.quote(str(folder))}`",
    )
    return 0


def training_bars() -> AbstractContextManager[TrainingCallback]:
    """Bars that show how far a training is, and a line for what came of each of its steps."""
    return _TrainingBars()


class _TrainingBars(LearningBars):
    """How far a training is, and what came of its steps."""

    def __init__(self) -> None:
        super().__init__(BarColumn(), TimeRemainingColumn())

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self.unfollow()
        super().on_progress(what, done, total)

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        console.print(f"{use}: task {index} is left out, as it has no plan: {reason}")

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """What was found worth learning."""
        console.print(f"{len(ranked)} candidates; the most promising:")
        for group in ranked[:5]:
            after = ", ".join(group.operator_path) or "the start"
            console.print(
                f"  {group.signature.name} after {after}: {group.relative_saving:.0%} of a plan, "
                f"found in {group.tasks} tasks",
            )

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self.unfollow()
        bar = self.bars.add_task(f"learning {name}", total=total_steps, detail="")
        work = ShortcutWorkFolder(folder)
        self.follow(lambda: self._update(bar, work), [bar])

    def _update(self, bar: TaskID, folder: ShortcutWorkFolder) -> None:
        stages = latest(folder)
        if stages:
            last = stages[max(stages)]
            length = "-" if isnan(last.length) else f"{last.length:.1f}"
            detail = f"success {last.success:.0%}, length {length}"
            steps = sum(stage.steps for stage in stages.values())
            self.bars.update(bar, completed=steps, detail=detail)

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        console.print(
            f"{name}: plans of {before:.1f} steps become {after:.1f}{'' if kept else '; not kept'}",
        )
