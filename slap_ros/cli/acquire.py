# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from slap_ros.acquisition.curriculum import Curriculum
from slap_ros.acquisition.problem import AcquisitionProblem
from slap_ros.acquisition.proposal import Proposal
from slap_ros.acquisition.proposers import (
    ComposedRewarder,
    ManualProposer,
    ManualRewarder,
    propose,
)
from slap_ros.acquisition.settings import ACQUISITION_SETTINGS, AcquisitionSettings
from slap_ros.acquisition.skill_library import (
    AcquiredSkill,
    SkillLibrary,
    load_skill_library,
    read_library_record,
    save_skill_library,
)
from slap_ros.acquisition.skill_training import Round
from slap_ros.acquisition.task_source import TaskSource
from slap_ros.cli.command_line import command_line
from slap_ros.cli.console import console, print_json, styled
from slap_ros.cli.options import MAX_SEED, DomainName, Goal, Jobs, Json, Preset
from slap_ros.cli.train import require_torch, training_workers
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable
from slap_ros.learning.setting_changes import changed, parse_changes

PROPOSERS = ("manual",)
REWARDERS = ("manual", "composed")


@dataclass(frozen=True)
class AcquireOptions:
    """What to acquire, how, and where to keep it."""

    domain: DomainName
    output: Annotated[
        Path | None, typer.Option(help="The library's folder. Default: runs/skills/DOMAIN.")
    ] = None
    preset: Preset = None
    goal: Goal = None
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Of everything.")] = 0
    proposer: Annotated[
        str, typer.Option(help="Of operators: manual, which are the domain's hand-written ones.")
    ] = "manual"
    rewarder: Annotated[
        str,
        typer.Option(help="Of rewards: manual (hand-written), or composed (from metrics)."),
    ] = "manual"
    begin: Annotated[
        list[Path] | None,
        typer.Option("--from", help="A skill library to begin with; may be repeated."),
    ] = None
    settings: Annotated[
        str, typer.Option(help=f"Networks and SAC: {', '.join(ACQUISITION_SETTINGS)}.")
    ] = "small"
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Change one of the settings, as sac.discount=0.99; may be repeated. A wrong name "
            "lists all.",
        ),
    ] = None
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps that all skills together learn for."),
    ] = None
    jobs: Jobs = 2
    ray: Annotated[
        str | None, typer.Option(help="Address of a Ray cluster to run on instead, or local.")
    ] = None
    work: Annotated[
        Path | None,
        typer.Option(help="Folder for checkpoints and results; the same one again goes on."),
    ] = None
    json: Json = False

    @property
    def library_folder(self) -> Path:
        """Where the library is saved."""
        return self.output or Path("runs/skills") / self.domain

    @property
    def work_folder(self) -> Path:
        """Where checkpoints are, by default beside the library."""
        return self.work or self.library_folder.with_name(f"{self.library_folder.name}-training")

    @property
    def acquisition_settings(self) -> AcquisitionSettings:
        """Hyper-parameters of the curriculum.

        Raises:
            InvalidParameterError: There are none of that name, or they cannot be changed so.
        """
        if self.settings not in ACQUISITION_SETTINGS:
            raise InvalidParameterError(
                f"unknown settings {self.settings!r}; there are {', '.join(ACQUISITION_SETTINGS)}"
            )
        changes = parse_changes(self.set or (), AcquisitionSettings)
        if self.steps is not None and "total_steps" in changes:
            raise InvalidParameterError("--steps and --set total_steps say the same: give one")
        chosen = changed(ACQUISITION_SETTINGS[self.settings], changes)
        return chosen if self.steps is None else replace(chosen, total_steps=self.steps)

    @property
    def command(self) -> str:
        """The command that acquires the same library again."""
        return command_line(
            "acquire",
            self.domain,
            preset=self.preset,
            goal=self.goal,
            seed=self.seed,
            proposer=self.proposer,
            rewarder=self.rewarder,
            settings=self.settings,
            steps=self.steps,
            set=self.set,
        )


def acquire(options: AcquireOptions) -> int:
    """Acquire skills: carry out plans, train what fails from where it fails, and again.

    Interrupted, it goes on where it was when the same command is given again.
    """
    domain = get_domain(options.domain, options.preset)
    options = replace(options, preset=domain.preset)
    settings = options.acquisition_settings
    for folder in (options.library_folder, options.work_folder):
        require_writable(folder)
    require_torch()
    goal = options.goal if options.goal is not None else next(iter(domain.goals), "")
    proposal = _proposal(domain, options, goal)
    source = TaskSource.of(domain, goal, options.seed, proposal.operators, proposal.rewards)
    known = _known(options.begin or ())
    with training_workers(options.jobs, options.ray) as workers, _AcquisitionBars() as bars:
        curriculum = Curriculum(source, settings, options.work_folder, workers, bars, known)
        library = curriculum.run()
    made_by = {
        "command": options.command,
        "proposer": options.proposer,
        "rewarder": options.rewarder,
        "began_with": [path.name for path in options.begin or ()],
    }
    library = replace(library, record={**made_by, **library.record})
    save_skill_library(options.library_folder, library)
    _report(options, library)
    return 0


def _proposal(domain: Domain, options: AcquireOptions, goal: str) -> Proposal:
    """Operators and rewards, checked.

    Args:
        domain: In which skills are acquired.
        options: Of the command.
        goal: A name, or atoms.

    Raises:
        InvalidParameterError: The domain says nothing of acquisition, or there is no such
            proposer.
        ProposalRejectedError: The operators make no plan.
    """
    if domain.acquisition is None:
        raise InvalidParameterError(
            f"domain {domain.name} does not say what skills are acquired with; `slap domains` "
            "lists those that do"
        )
    if options.proposer not in PROPOSERS:
        known = ", ".join(PROPOSERS)
        raise InvalidParameterError(f"--proposer {options.proposer!r}: there are {known}")
    if options.rewarder not in REWARDERS:
        known = ", ".join(REWARDERS)
        raise InvalidParameterError(f"--rewarder {options.rewarder!r}: there are {known}")
    task = task_with_goal(domain, options.seed, 0, goal)
    problem = AcquisitionProblem.of_task(domain, task)
    written = domain.acquisition
    composed = options.rewarder == "composed"
    rewarder = ComposedRewarder() if composed else ManualRewarder(written.rewards)
    return propose(problem, ManualProposer(written.operators, "the domain's own"), rewarder)


def _known(paths: list[Path] | tuple[()]) -> dict[str, AcquiredSkill]:
    """The skills of libraries, each in the words of its own domain, by folder.

    Raises:
        InvalidLibraryError: One of them cannot be read.
    """
    known: dict[str, AcquiredSkill] = {}
    for path in paths:
        about = read_library_record(path)
        library = load_skill_library(path, get_domain(about["domain"], about.get("preset")))
        for reason in library.refused:
            console.print(styled("warning", "yellow", f" a skill is left out: {reason}"))
        known |= {str(path / skill.folder_name): skill for skill in library.skills}
    return known


def _report(options: AcquireOptions, library: SkillLibrary) -> None:
    record = library.record
    if options.json:
        print_json({"library": str(options.library_folder), "digest": library.digest, **record})
    if not library.skills:
        console.print(f"nothing was learned: {record['ended']}")
    for name, why in record["left"].items():
        console.print(f"{name} was not learned well enough: {why}")
    console.print(
        f"{len(library.skills)} skills in {options.library_folder}: {record['ended']}; "
        f"task progress {record['progress_on_fresh_tasks']:.2f} on tasks that training never saw, "
        f"{record['steps']} environment steps; `slap skills {options.library_folder}` shows them",
    )


class _AcquisitionBars:
    """Progress on the terminal."""

    def __init__(self) -> None:
        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.completed} of {task.total}"),
            console=console,
            transient=True,
        )
        self._tasks: dict[str, TaskID] = {}

    def __enter__(self) -> _AcquisitionBars:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def on_progress(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done."""
        if what not in self._tasks:
            self._tasks[what] = self._bars.add_task(what, total=total)
        self._bars.update(self._tasks[what], completed=done)
        if done == total:
            self._bars.remove_task(self._tasks.pop(what))

    def on_rollouts(self, iteration: int, progress: float, failures: dict[str, int]) -> None:
        """How far plans got."""
        failed = ", ".join(f"{name} {count} times" for name, count in failures.items())
        console.print(
            f"iteration {iteration}: task progress {progress:.2f}; failed: {failed or 'nothing'}"
        )

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """What a round of training was worth."""
        console.print(
            f"iteration {iteration}, {skill}: success {outcome.initial:.2f} became "
            f"{outcome.success:.2f} in {len(outcome.segments)} segments"
        )
