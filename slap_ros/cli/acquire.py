# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.proposals.attempt_log import Entry
from slap_ros.acquisition.proposals.inquiry import described
from slap_ros.acquisition.proposals.proposer_names import MANUAL, REWARDERS, require_known
from slap_ros.acquisition.training.settings import ACQUISITION_SETTINGS
from slap_ros.api.acquisition import AcquisitionWatch, acquirable, carry_out
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.training import training_folder
from slap_ros.cli.acquisition_bars import AcquisitionBars
from slap_ros.cli.acquisition_events import AcquisitionEvents
from slap_ros.cli.console import console, print_json, warn
from slap_ros.cli.options import Goal, Json
from slap_ros.cli.propose import show_entry
from slap_ros.cli.proposer_options import ProposerOptions
from slap_ros.cli.training_options import (
    BeginWith,
    Events,
    Ray,
    Rewarder,
    TrainingSeed,
    WorkFolder,
    new_library,
    setting_changes,
)
from slap_ros.errors import InvalidParameterError
from slap_ros.skills.skill_library import SkillLibrary

LIBRARIES = Path("runs/skills")


@dataclass(frozen=True)
class AcquireOptions:
    """What to acquire, how, and where to keep it."""

    domain: DomainName
    output: Annotated[Path | None, new_library(LIBRARIES)] = None
    preset: Preset = None
    goal: Goal = None
    seed: TrainingSeed = 0
    rewarder: Rewarder = MANUAL
    begin: BeginWith = None
    encoder: Annotated[
        str | None,
        typer.Option(
            help="With --from: embedding model that finds similar skills, one at --base-url or "
            "local:PACKAGE. Default: no model; compare the metrics behind the operators."
        ),
    ] = None
    keep: Annotated[
        Path | None,
        typer.Option(
            help="Skill library to keep: learn the skills that it lacks, and train further those "
            "that fail."
        ),
    ] = None
    shortcuts: Annotated[
        Path | None,
        typer.Option(
            help="Shortcut library over the skills to --keep: skills that fail where its shortcuts "
            "have led are learned from there."
        ),
    ] = None
    revise: Annotated[
        bool,
        typer.Option(
            "--revise",
            help="Tell the language model how skills failed that are given up, and learn them "
            "again with what it changes, at most three times.",
        ),
    ] = False
    settings: Annotated[
        str, typer.Option(help=f"Networks and SAC: {', '.join(ACQUISITION_SETTINGS)}.")
    ] = "small"
    set: Annotated[list[str] | None, setting_changes("sac.gamma=0.99")] = None
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps of training, all skills together."),
    ] = None
    jobs: Jobs = 2
    ray: Ray = None
    work: WorkFolder = None
    events: Events = False
    json: Json = False

    def __post_init__(self) -> None:
        require_known("--rewarder", self.rewarder, REWARDERS)
        if self.encoder is not None and not self.begin:
            raise InvalidParameterError("--encoder is for --from: without, nothing is retrieved")

    @property
    def library_folder(self) -> Path:
        """Where the library is saved."""
        return self.output or LIBRARIES / self.domain

    def request(self, proposers: ProposerOptions) -> AcquisitionRequest:
        """What is to be acquired.

        Raises:
            InvalidParameterError: The domain says nothing of acquisition, or options do not fit.
        """
        return AcquisitionRequest(
            domain=acquirable(self.domain, self.preset),
            library_folder=self.library_folder,
            work_folder=training_folder(self.library_folder, self.work),
            proposers=proposers,
            goal=self.goal,
            seed=self.seed,
            rewarder=self.rewarder,
            settings=self.settings,
            changes=self.set or (),
            steps=self.steps,
            begin_with=self.begin or (),
            encoder=self.encoder,
            keep=self.keep,
            revise=self.revise,
            shortcuts=self.shortcuts,
        )


def acquire(options: AcquireOptions, proposers: ProposerOptions) -> int:
    """Acquire skills: execute plans, train each skill that fails from where it fails, repeat.

    After an interruption, the same command goes on where it stopped.
    """
    request = options.request(proposers)
    segment_steps = request.chosen_settings().segment_steps(horizon_of(request.domain))
    events = AcquisitionEvents(segment_steps if options.events else None)

    def show(entry: Entry) -> None:
        show_entry(entry)
        events.attempted(entry)

    watch = AcquisitionWatch(
        on_attempt=show,
        on_proposal=events.proposed,
        curriculum=lambda: AcquisitionBars(events),
        tell=warn,
    )
    library = carry_out(request, options.jobs, options.ray, watch)
    events.acquired(request.library_folder, library)
    _report(options, request.work_folder, library)
    return 0


def _report(options: AcquireOptions, work_folder: Path, library: SkillLibrary) -> None:
    record = library.record
    if options.json:
        print_json({"library": str(options.library_folder), "digest": library.digest, **record})
    if not library.skills:
        console.print(f"nothing was learned: {record['ended']}")
    for name, found in record["left"].items():
        console.print(f"{name} was not learned well enough: {why_left(found)}")
    if record["left"]:
        last = work_folder / f"iteration{len(record['progress']) - 1}" / "rollouts.json"
        console.print(f"{last} has the states")
    if record.get("answered_by"):
        console.print(f"operators or rewards are {described(record['answered_by'])}")
    console.print(
        f"{len(library.skills)} skills in {options.library_folder}: {record['ended']}; "
        f"task progress {record['progress_on_fresh_tasks']:.2f} on tasks that training never saw, "
        f"{record['steps']} environment steps; `slap skills {options.library_folder}` shows them",
    )


def why_left(found: dict[str, Any]) -> str:
    """Why a skill was given up, in words: from how many states, and what its failures share.

    Args:
        found: Record of the given-up skill, as the curriculum writes it.
    """
    if "states" not in found:
        return str(found["why"])
    ends = ", ".join(f"{end} ({count} times)" for end, count in found["ends"].items())
    atoms = ", ".join(f"{atom} ({count} times)" for atom, count in found["atoms"].items())
    wrong = f"; most often not as it should be: {atoms}" if atoms else ""
    return f"{found['why']} from {found['states']} states: {ends}{wrong}"
