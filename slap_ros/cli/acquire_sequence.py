# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire-sequence``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.training.settings import ACQUISITION_SETTINGS
from slap_ros.api.acquisition import AcquisitionWatch, acquirable, require_budget
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.acquisition_sequence import acquire_sequence
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.sequence_request import SequenceRequest
from slap_ros.api.sequence_step import SequenceStep
from slap_ros.api.training import training_folder
from slap_ros.cli.acquisition_bars import AcquisitionBars
from slap_ros.cli.acquisition_events import AcquisitionEvents
from slap_ros.cli.console import console, print_json, warn
from slap_ros.cli.options import Json
from slap_ros.cli.training_options import Ray, TrainingSeed, WorkFolder, setting_changes
from slap_ros.core import Domain

LIBRARIES = Path("runs/sequences")


@dataclass(frozen=True)
class SequenceOptions:
    """The goals, how skills are acquired for them, and where they are kept."""

    domain: DomainName
    output: Annotated[
        Path | None,
        CommandOption(
            "Folder of the new library, one per seed where there are several. Default: "
            f"{LIBRARIES}/DOMAIN."
        ),
    ] = None
    preset: Preset = None
    goal: Annotated[
        list[str] | None,
        CommandOption(
            "Goal of the sequence, a name or atoms. May be repeated, in the order in which goals "
            "are learned. Default: all goals of the domain."
        ),
    ] = None
    seed: TrainingSeed = 0
    seeds: Annotated[
        int, CommandOption("Number of seeds, from --seed on: a sequence for each.", least=1)
    ] = 1
    scratch: Annotated[
        bool,
        typer.Option("--scratch", help="Learn every goal from scratch, for comparison."),
    ] = False
    relearn: Annotated[
        bool,
        typer.Option(
            "--relearn",
            help="After each goal, learn earlier goals again of whose tasks fewer than .8 are "
            "solved then, or fewer than --set solved says.",
        ),
    ] = False
    tasks: Annotated[
        int, CommandOption("Number of tasks per goal to try all goals so far in.", least=1)
    ] = 20
    settings: Annotated[
        str, typer.Option(help=f"Networks and SAC: {', '.join(ACQUISITION_SETTINGS)}.")
    ] = "small"
    set: Annotated[list[str] | None, setting_changes("sac.gamma=0.99")] = None
    steps: Annotated[
        int | None, CommandOption("Environment steps for each goal, all skills together.", least=1)
    ] = None
    jobs: Jobs = 2
    ray: Ray = None
    work: WorkFolder = None
    json: Json = False

    def request(self, domain: Domain, seed: int) -> SequenceRequest:
        """What is to be acquired with one seed.

        Args:
            domain: Domain to acquire skills in.
            seed: Seed of the sequence.
        """
        room = self.output or LIBRARIES / self.domain
        several = self.seeds > 1
        folder = room / str(seed) if several else room
        work = self.work / str(seed) if self.work and several else self.work
        acquisition = AcquisitionRequest(
            domain=domain,
            library_folder=folder,
            work_folder=training_folder(folder, work),
            seed=seed,
            settings=self.settings,
            changes=self.set or (),
            steps=self.steps,
        )
        goals = self.goal or list(domain.goals)
        return SequenceRequest(acquisition, goals, self.scratch, self.tasks, self.relearn)


def acquire_sequence_command(options: SequenceOptions) -> int:
    """Acquire skills for one goal after another, with one library that grows.

    A goal is done once three judgements in a row had .8 of its tasks solved (--set solved=0.8).
    With --set solved=1, a goal goes on until nothing fails, or its --steps are spent.

    After an interruption, the same command goes on where it stopped.
    """
    domain = acquirable(options.domain, options.preset)
    requests = [options.request(domain, options.seed + number) for number in range(options.seeds)]
    settings = requests[0].acquisition.chosen_settings()
    require_budget(settings, settings.segment_steps(horizon_of(domain)))
    watch = AcquisitionWatch(curriculum=lambda: AcquisitionBars(AcquisitionEvents(None)), tell=warn)
    found = {}
    for request in requests:
        seed, folder = request.acquisition.seed, request.acquisition.library_folder
        steps = acquire_sequence(request, options.jobs, options.ray, watch, _tell_goal(request))
        found[str(seed)] = [step.as_json() for step in steps]
        _report(seed, folder, steps)
    if options.json:
        print_json({"domain": domain.name, "scratch": options.scratch, "seeds": found})
    return 0


def _tell_goal(request: SequenceRequest) -> Callable[[int, str], None]:
    """What says which goal begins."""
    seed, goals = request.acquisition.seed, len(request.goals)
    return lambda number, goal: console.print(f"seed {seed}, goal {number + 1} of {goals}: {goal}")


def _report(seed: int, folder: Path, steps: list[SequenceStep]) -> None:
    for step in steps:
        *earlier, own = step.solved.values()
        before = f", {min(earlier):.2f} or more on each goal before it" if earlier else ""
        console.print(
            f"seed {seed}, {step.goal}: {step.steps} environment steps ({step.ended}); success "
            f"{own:.2f}{before}"
        )
    console.print(f"the library is in {folder}; `slap skills {folder}` shows it")
