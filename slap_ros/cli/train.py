# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap train``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from math import isnan
from os.path import relpath
from pathlib import Path
from time import monotonic
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, TaskID, TimeRemainingColumn

from slap_ros.acquisition.domain_choice import SHIPPED, WORDS, DomainChoice
from slap_ros.cli.console import console, print_json
from slap_ros.cli.learning_bars import LearningBars
from slap_ros.cli.options import DomainName, Json, Preset, Ray, TrainingSeed
from slap_ros.cli.skill_choice import Skills, open_chosen
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable, sole_use
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import Workers, local_workers, ray_workers
from slap_ros.planning.planner import require_skills
from slap_ros.shortcuts.library import save_library
from slap_ros.shortcuts.progress import latest
from slap_ros.shortcuts.settings import TrainingSettings, training_settings
from slap_ros.shortcuts.training import CandidateGroup, Training
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
from slap_ros.studies.results import describe_skills


@dataclass(frozen=True)
class TrainOptions:
    """What to train, how, and where to keep it."""

    domain: DomainName
    output: Annotated[
        Path | None, typer.Option(help="Folder of the new library. Default: runs/models/DOMAIN.")
    ] = None
    preset: Preset = None
    skills: Skills = SHIPPED
    seed: TrainingSeed = 0
    settings: Annotated[
        str,
        typer.Option(
            help="Hyper-parameters: ours, ours_several (more shortcuts, also for random goals), "
            "paper (the paper's), or the name of the domain's own."
        ),
    ] = "ours"
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Change one of the settings, such as exploration.rollouts=16. May be repeated. A "
            "wrong name lists all names.",
        ),
    ] = None
    steps: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Environment steps per shortcut, all stages together. Default: as in the "
            "settings.",
        ),
    ] = None
    jobs: Annotated[int, typer.Option(min=1, help="Number of processes.")] = 2
    ray: Ray = None
    work: Annotated[
        Path | None,
        typer.Option(
            help="Folder for checkpoints and logs. With the same folder again, training goes on."
        ),
    ] = None
    json: Json = False

    @property
    def library_folder(self) -> Path:
        """Where the library is saved."""
        return self.output or Path("runs/models") / self.domain

    @property
    def work_folder(self) -> Path:
        """Where checkpoints and logs are, by default beside the library."""
        return self.work or self.library_folder.with_name(f"{self.library_folder.name}-training")

    def training_settings(self, domain: Domain) -> TrainingSettings:
        """Hyper-parameters of the training.

        Raises:
            InvalidParameterError: There are none of that name, or they cannot be changed so.
            InvalidDomainError: See :func:`~slap_ros.shortcuts.settings.training_settings`.
        """
        chosen = training_settings(self.settings, domain)
        changes = parse_changes(self.set or (), TrainingSettings)
        if self.steps is not None and (both := [n for n in changes if n.endswith("total_steps")]):
            raise InvalidParameterError(f"--steps and --set {both[0]} say the same: give one")
        chosen = changed(chosen, changes)
        return chosen if self.steps is None else chosen.with_total_steps(self.steps)

    @property
    def command(self) -> str:
        """The command that trains the same library again."""
        command = f"slap train {self.domain} --preset {self.preset}{self.skills_given}"
        steps = "" if self.steps is None else f" --steps {self.steps}"
        changes = "".join(f" --set {shlex.quote(text)}" for text in self.set or ())
        return f"{command} --seed {self.seed} --settings {self.settings}{steps}{changes}"

    @property
    def skills_given(self) -> str:
        """The option ``--skills`` as a part of commands; never an absolute path."""
        name = self.skills if self.skills in WORDS else relpath(self.skills)
        return f" --skills {shlex.quote(name)}" if self.skills else ""


def train(options: TrainOptions) -> int:
    """Find and learn shortcuts: explore, rank, train, keep what makes plans shorter.

    After an interruption, the same command goes on where it stopped. The work folder has logs for
    TensorBoard.
    """
    domain = open_chosen(options.domain, options.preset, options.skills)
    require_skills(domain)
    options = replace(options, preset=domain.preset)
    settings = options.training_settings(domain)
    for folder in (options.library_folder, options.work_folder):
        require_writable(folder)
    require_torch()
    began, folder = monotonic(), options.library_folder
    distribution = TaskDistribution(DomainChoice.of(domain, options.skills), options.seed)
    with (
        sole_use(options.work_folder),
        training_workers(options.jobs, options.ray) as workers,
        _TrainingBars() as bars,
    ):
        library = Training(distribution, settings, options.work_folder, workers, bars).run()
    made_by: dict[str, Any] = {"command": options.command}
    if acquired := describe_skills(domain):
        made_by["skills"] = acquired
    library = replace(library, record={**made_by, **library.record})
    save_library(folder, library)
    seconds = monotonic() - began
    if options.json:
        print_json({"library": str(folder), **library.record, "seconds": seconds})
    console.print(
        f"{len(library.shortcuts)} shortcuts in {folder}, {seconds:.0f} s; see what they are worth "
        f"with `slap evaluate {options.domain}{options.skills_given} --shortcuts {folder}`",
    )
    return 0


def training_workers(jobs: int, ray: str | None) -> AbstractContextManager[Workers]:
    """So many processes, or the Ray cluster at an address."""
    return local_workers(jobs) if ray is None else ray_workers(ray)


def require_torch() -> None:
    """Refuse to train without what training needs.

    It is looked for and not imported: jobs import it, and this process would for seconds.

    Raises:
        InvalidParameterError: It is not installed.
    """
    missing = [name for name in ("torch", "stable_baselines3") if find_spec(name) is None]
    if missing:
        raise InvalidParameterError(
            f"training needs torch and stable-baselines3, and there is no {missing[0]}: "
            "pip install 'slap_ros[train]'"
        )


class _TrainingBars(LearningBars):
    """How far a training is, and what came of its steps."""

    def __init__(self) -> None:
        super().__init__(BarColumn(), TimeRemainingColumn())

    def on_progress(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done; what was learned before them is."""
        self.unfollow()
        super().on_progress(what, done, total)

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """A task has no plan."""
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
        """Follow a training."""
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
        """What it is worth."""
        console.print(
            f"{name}: plans of {before:.1f} steps become {after:.1f}{'' if kept else '; not kept'}",
        )
