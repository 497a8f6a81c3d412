# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap grow``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.acquisition.proposals.attempt_log import Entry
from slap_ros.acquisition.proposals.proposer_names import MANUAL
from slap_ros.acquisition.training.settings import ACQUISITION_SETTINGS
from slap_ros.api.acquisition import AcquisitionWatch, acquirable
from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.growing import PAGE, GrowthWatch, grow_rounds
from slap_ros.api.growth import STEPS, GrowthRequest, GrowthRound
from slap_ros.cli.acquisition_bars import AcquisitionBars
from slap_ros.cli.acquisition_events import AcquisitionEvents
from slap_ros.cli.console import console, print_json, warn
from slap_ros.cli.growth_events import GrowthEvents, ShortcutEvents
from slap_ros.cli.options import Goal, Json
from slap_ros.cli.propose import show_entry
from slap_ros.cli.proposer_options import ProposerOptions
from slap_ros.cli.train import training_bars
from slap_ros.cli.training_options import BeginWith, Events, Rewarder, TrainingSeed, setting_changes
from slap_ros.shortcuts.named_settings import NEAR
from slap_ros.shortcuts.training_callback import TrainingCallback

ROOM = Path("runs/grown")


@dataclass(frozen=True)
class GrowOptions:
    """What is to grow, how, and where it is kept."""

    domain: DomainName
    output: Annotated[
        Path | None,
        typer.Option(
            help="Folder of all results. With the same folder again, it goes on. Default: "
            f"{ROOM}/DOMAIN."
        ),
    ] = None
    preset: Preset = None
    goal: Goal = None
    seed: TrainingSeed = 0
    rewarder: Rewarder = MANUAL
    begin: BeginWith = None
    keep: Annotated[
        Path | None,
        typer.Option(
            help="Skill library to keep in the first round: learn the skills that it lacks, and "
            "train further those that fail."
        ),
    ] = None
    skill_settings: Annotated[
        str,
        typer.Option(help=f"Networks and SAC of skills: {', '.join(ACQUISITION_SETTINGS)}."),
    ] = "small"
    set_skills: Annotated[list[str] | None, setting_changes("sac.gamma=0.99")] = None
    settings: Annotated[
        str,
        typer.Option(
            help="Hyper-parameters of shortcuts, as for `slap train`. With ours_approaches, they "
            "may begin with a way round an object."
        ),
    ] = NEAR
    set: Annotated[list[str] | None, setting_changes("exploration.rollouts=16")] = None
    steps: Annotated[
        int,
        typer.Option(
            min=1, help="Environment steps of learning and exploring, all rounds together."
        ),
    ] = STEPS
    jobs: Jobs = 2
    events: Events = False
    json: Json = False

    def request(self, proposers: ProposerOptions) -> GrowthRequest:
        """What is to grow.

        Args:
            proposers: Proposer of the operators.

        Raises:
            InvalidParameterError: Options do not fit together, or the steps are too few.
        """
        return GrowthRequest(
            domain=acquirable(self.domain, self.preset),
            folder=self.output or ROOM / self.domain,
            proposers=proposers,
            goal=self.goal,
            seed=self.seed,
            rewarder=self.rewarder,
            begin_with=self.begin or (),
            keep=self.keep,
            skill_settings=self.skill_settings,
            skill_changes=self.set_skills or (),
            shortcut_settings=self.settings,
            shortcut_changes=self.set or (),
            steps=self.steps,
        )


def grow(options: GrowOptions, proposers: ProposerOptions) -> int:
    """Acquire skills, learn shortcuts over them, and again, until plans get no shorter.

    From the second round on, skills are learned from where plans with shortcuts fail. After an
    interruption, the same command goes on where it stopped.
    """
    request = options.request(proposers)
    events = GrowthEvents(options.events)
    grown = grow_rounds(request, options.jobs, _watch(request, events))
    events.grown(request.folder, grown)
    if options.json:
        print_json(grown.as_json())
    console.print(
        f"{len(grown.rounds)} rounds, the best is round {grown.best + 1}: {grown.ended}. Skills, "
        f"shortcuts and {PAGE} are in {request.folder}"
    )
    return 0


def _watch(request: GrowthRequest, events: GrowthEvents) -> GrowthWatch:
    """What shows people how far growing is, and prints events.

    Args:
        request: What is to grow.
        events: Prints events.
    """
    of_skills = AcquisitionEvents(request.least_skill_steps if events.printed else None)

    def show_attempt(entry: Entry) -> None:
        show_entry(entry)
        of_skills.attempted(entry)

    def show_round(number: int, one: GrowthRound) -> None:
        _show_round(number, one)
        events.on_round(number, one)

    @contextmanager
    def shortcuts() -> Iterator[TrainingCallback]:
        with training_bars() as bars:
            yield ShortcutEvents(events, bars)

    skills = AcquisitionWatch(
        on_attempt=show_attempt,
        on_proposal=of_skills.proposed,
        curriculum=lambda: AcquisitionBars(of_skills),
        tell=warn,
    )
    return GrowthWatch(skills, shortcuts, show_round)


def _show_round(number: int, one: GrowthRound) -> None:
    """Say what a round has brought."""
    kept = sum(tried.kept for tried in one.tried)
    console.print(
        f"round {number + 1}: {len(one.skills)} skills, task progress {one.progress:.2f}; "
        f"{kept} of {len(one.tried)} shortcuts kept; plans of {one.length_alone:.1f} steps become "
        f"{one.length:.1f}"
    )
