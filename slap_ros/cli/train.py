# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap train``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from slap_ros.cli.console import console, print_json
from slap_ros.cli.options import MAX_SEED, DomainName, Json, Preset
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, require_writable
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import Workers, local_workers, ray_workers
from slap_ros.planning.planner import require_skills
from slap_ros.shortcuts.library import save_library
from slap_ros.shortcuts.settings import TrainingSettings, training_settings
from slap_ros.shortcuts.training import CandidateGroup, Training
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

REFRESH_S = 1.0


@dataclass(frozen=True)
class TrainOptions:
    """What to train, how, and where to keep it."""

    domain: DomainName
    output: Annotated[
        Path | None, typer.Option(help="The library's folder. Default: runs/models/DOMAIN.")
    ] = None
    preset: Preset = None
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Of everything.")] = 0
    settings: Annotated[
        str, typer.Option(help="ours, paper (the paper's hyper-parameters), or the domain's own.")
    ] = "ours"
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Change one of the settings, as exploration.rollouts=16; may be repeated. A wrong "
            "name lists all.",
        ),
    ] = None
    steps: Annotated[
        int | None,
        typer.Option(
            min=1, help="Environment steps per shortcut, all stages together; default: settings'."
        ),
    ] = None
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 2
    ray: Annotated[
        str | None, typer.Option(help="Address of a Ray cluster to run on instead, or local.")
    ] = None
    work: Annotated[
        Path | None,
        typer.Option(help="Folder for checkpoints and logs; the same one again goes on."),
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
        command = f"slap train {self.domain} --preset {self.preset} --seed {self.seed}"
        steps = "" if self.steps is None else f" --steps {self.steps}"
        changes = "".join(f" --set {shlex.quote(text)}" for text in self.set or ())
        return f"{command} --settings {self.settings}{steps}{changes}"


def train(options: TrainOptions) -> int:
    """Discover and learn shortcuts: explore, rank, train, keep what makes plans shorter.

    Interrupted, it goes on where it was when the same command is given again. Progress for
    TensorBoard is in the work folder.
    """
    domain = get_domain(options.domain, options.preset)
    require_skills(domain)
    options = replace(options, preset=domain.preset)
    settings = options.training_settings(domain)
    for folder in (options.library_folder, options.work_folder):
        require_writable(folder)
    require_torch()
    began, folder = monotonic(), options.library_folder
    distribution = TaskDistribution(domain.name, domain.preset, options.seed)
    with training_workers(options.jobs, options.ray) as workers, _TrainingBars() as bars:
        library = Training(distribution, settings, options.work_folder, workers, bars).run()
    library = replace(library, record={"command": options.command, **library.record})
    save_library(folder, library)
    seconds = monotonic() - began
    if options.json:
        print_json({"library": str(folder), **library.record, "seconds": seconds})
    console.print(
        f"{len(library.shortcuts)} shortcuts in {folder}, {seconds:.0f} s; see what they are worth "
        f"with `slap evaluate {options.domain} --shortcuts {folder}`",
    )
    return 0


def training_workers(jobs: int, ray: str | None) -> AbstractContextManager[Workers]:
    """So many processes, or the Ray cluster at an address."""
    return local_workers(jobs) if ray is None else ray_workers(ray)


def require_torch() -> None:
    """Refuse to train without what training needs.

    Raises:
        InvalidParameterError: It is not installed.
    """
    try:
        import stable_baselines3  # noqa: F401
    except ImportError as error:
        raise InvalidParameterError(
            f"training needs torch and stable-baselines3 ({error}): pip install 'slap_ros[train]'"
        ) from error


class _TrainingBars:
    """Progress on the terminal. What is learned elsewhere is followed by its progress file."""

    def __init__(self) -> None:
        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[detail]}", markup=False),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._counting: dict[str, TaskID] = {}
        self._following: tuple[Event, Thread] | None = None

    def __enter__(self) -> _TrainingBars:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._unfollow()
        self._bars.stop()

    def on_progress(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done."""
        self._unfollow()
        if done == 0 or what not in self._counting:
            self._counting[what] = self._bars.add_task(what, total=total, detail="")
        self._bars.update(self._counting[what], completed=done, detail=f"{done} of {total}")
        if done == total:
            self._bars.remove_task(self._counting.pop(what))

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
        self._unfollow()
        bar = self._bars.add_task(f"learning {name}", total=total_steps, detail="")
        stop = Event()
        arguments = (ShortcutWorkFolder(folder), bar, stop)
        thread = Thread(target=self._follow, args=arguments, daemon=True)
        self._following = stop, thread
        thread.start()

    def _follow(self, folder: ShortcutWorkFolder, bar: TaskID, stop: Event) -> None:
        while not stop.wait(REFRESH_S):
            stages = _latest(folder.progress)
            if stages:
                last = stages[max(stages)]
                length = "-" if last["length"] is None else f"{last['length']:.1f}"
                detail = f"success {last['success']:.0%}, length {length}"
                steps = sum(stage["steps"] for stage in stages.values())
                self._bars.update(bar, completed=steps, detail=detail)
        self._bars.remove_task(bar)

    def _unfollow(self) -> None:
        if self._following is not None:
            stop, thread = self._following
            stop.set()
            thread.join()
            self._following = None

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """What it is worth."""
        console.print(
            f"{name}: plans of {before:.1f} steps become {after:.1f}{'' if kept else '; not kept'}",
        )


def _latest(path: Path) -> dict[int, dict[str, Any]]:
    """The last line of each stage in a progress file; an unfinished line is left out."""
    if not path.exists():
        return {}
    lines = read_text(path).split("\n")[:-1]
    return {line["stage"]: line for line in map(parse_json, lines)}
