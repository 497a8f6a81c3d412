# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the parts of acquiring skills are worth: the same trainings without each (LG-SAIL §4)."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposers import ComposedRewarder
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition import acquirable, require_budget
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.jobs import require_torch
from slap_ros.api.learning_curves import PLAN, steps_to
from slap_ros.api.left_out import Tell
from slap_ros.core import Action, Domain, Policy
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.relational import Object, State
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.learning_curves import (
    AcquisitionSetup,
    LearningCurves,
    format_steps_to,
    learn_skills,
)
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOTHING = "nothing"  # is left out: skills are acquired as `slap acquire` does
REWARDS = "rewards by hand"  # composed from metrics instead
APPROACH = "approach"  # a skill begins where the hand is
Change = Callable[[AcquisitionSettings], AcquisitionSettings]
SETTINGS: Mapping[str, Change] = {
    "dense reward": lambda ours: replace(ours, dense_share=0.0),
    "rehearsal": lambda ours: replace(ours, rehearsal=0.0),
    "held noise": lambda ours: replace(ours, sac=replace(ours.sac, longest_hold=1)),
    "normalised critics": lambda ours: replace(
        ours, sac=replace(ours.sac, critic_layer_norm=False)
    ),
}
PARTS = (NOTHING, REWARDS, APPROACH, *SETTINGS)
LEVEL = 0.8  # task progress up to which steps are counted
MEASURED = """\
Each row leaves out the part that it names, and nothing else, for the same seeds and tasks. Without
*rewards by hand*, rewards are composed from the metrics behind what an operator adds. Without the
*approach* (LG-SAIL's transition primitive), a skill begins where the hand happens to be. Without
*dense reward*, success alone is paid. Without *rehearsal*, no state is learned from in which the
skill succeeded before. Without *held noise*, exploration draws new noise in every step. Without
*normalised critics*, hidden layers of the critics are not normalised. Of LG-SAIL §4, a replay
buffer for each ground skill and episodes that end on success were not tried.

Task progress is the share of a plan's stages that were done in the end, on tasks that no training
saw. Steps are environment steps of learning: until a task progress of {level:g} was first measured,
between rounds of training, and of the whole training, which ends early where nothing fails any
more, and after {budget:,} steps. Where a training never came to {level:g}, its own steps are
counted, and the cell has a ≥. Means ± sample standard deviations are over {seeds} seeds. With so
few, a difference of less than two standard deviations says nothing.
"""


@dataclass(frozen=True, kw_only=True)
class ApproachlessChoice(DomainChoice):
    """A domain in which skills begin where the hand is, made where it is needed."""

    @property
    def identity(self) -> dict[str, str]:
        """See :attr:`slap_ros.skills.domain_choice.DomainChoice.identity`."""
        return {**super().identity, "without": APPROACH}

    def make(self) -> Domain:
        """See :meth:`slap_ros.skills.domain_choice.DomainChoice.make`."""
        domain = super().make()
        assert domain.acquisition is not None
        return replace(domain, acquisition=replace(domain.acquisition, approach=_stay))


def _stay(_state: State, _objects: tuple[Object, ...]) -> Policy:
    """An approach that is over before it begins."""

    def arrived(_: State) -> Action | None:
        return None

    return arrived


@dataclass(frozen=True, kw_only=True)
class AblatedSetup(AcquisitionSetup):
    """Trainings without a part.

    Args:
        without: The part, one of :data:`PARTS`.
    """

    without: str

    @classmethod
    def of(cls, setup: AcquisitionSetup, without: str) -> AblatedSetup:
        """The same trainings without a part.

        Args:
            setup: Trainings with all parts.
            without: The part, one of :data:`PARTS`.
        """
        settings = SETTINGS[without](setup.settings) if without in SETTINGS else setup.settings
        return cls(setup.domain, setup.preset, setup.goal, settings, without=without)

    def source(self, seed: int) -> TaskSource:
        """See :meth:`AcquisitionSetup.source`."""
        source = super().source(seed)
        if self.without == APPROACH:
            ours = source.domain
            return replace(source, domain=ApproachlessChoice(ours.name, ours.preset, ours.skills))
        if self.without == REWARDS:
            domain, operators = acquirable(self.domain, self.preset), source.operators()
            problem = AcquisitionProblem.of_task(domain, source.task(0))
            composed = ComposedRewarder().rewards(operators, problem)
            return TaskSource.of(domain, self.goal, seed, operators, composed)
        return source


@dataclass(frozen=True)
class PartResult:
    """What was learned without a part, a training per seed."""

    without: str
    trainings: tuple[LearningCurves, ...]

    @property
    def progress(self) -> list[float]:
        """Task progress in the end, of each training."""
        return [training.progress for training in self.trainings]

    @property
    def steps_to_level(self) -> list[tuple[int, bool]]:
        """Environment steps to :data:`LEVEL` of each training, and whether it came there."""
        return [steps_to(training.curves[PLAN], LEVEL) for training in self.trainings]

    @property
    def steps(self) -> list[int]:
        """Environment steps of each training."""
        return [training.curves[PLAN][-1].steps for training in self.trainings]

    def as_json(self) -> dict[str, Any]:
        """The summary, and all measurements."""
        return {
            "without": self.without,
            "progress": self.progress,
            "steps_to_level": [steps for steps, _ in self.steps_to_level],
            "reached": [reached for _, reached in self.steps_to_level],
            "steps": self.steps,
            "trainings": [training.as_json() for training in self.trainings],
        }


def study(
    setup: AcquisitionSetup, parts: Sequence[str], seeds: int, runner: JobRunner, folder: Path
) -> StudyReport:
    """Acquire skills with and without each part.

    Args:
        setup: Domain, goal and settings of the trainings.
        parts: Parts to leave out, of :data:`PARTS`.
        seeds: Number of trainings for each part, with seeds from 0 on.
        runner: Runner of the jobs.
        folder: Folder for checkpoints.

    Returns:
        The report.
    """
    batch = {
        f"{part} {seed}": (AblatedSetup.of(setup, part), seed, (), str(folder / f"{part}-{seed}"))
        for part in parts
        for seed in range(seeds)
    }
    found = runner.run("acquiring skills", learn_skills, LearningCurves.from_json, batch)
    results = [
        PartResult(part, tuple(found[f"{part} {seed}"] for seed in range(seeds))) for part in parts
    ]
    budget = setup.settings.total_steps
    return StudyReport(
        study="acquisition_ablation",
        source="LG-SAIL §4",
        title=f"Parts of acquiring skills: {setup.domain}",
        measured=MEASURED.format(level=LEVEL, budget=budget, seeds=seeds),
        table=MarkdownTable(
            ("without", "task progress", f"steps to {LEVEL:g}", "steps of the training"),
            [list(_row(result)) for result in results],
        ),
        found={"goal": setup.goal, "parts": [result.as_json() for result in results]},
        draw=lambda figure: draw(figure, results),
        size=(6.4, 0.8 + 0.42 * len(results)),
    )


def _row(result: PartResult) -> Iterator[str]:
    yield result.without
    yield format_spread(Spread.of(result.progress), 2)
    yield format_steps_to([training.curves[PLAN] for training in result.trainings], LEVEL)
    yield format_spread(Spread.of([float(steps) for steps in result.steps]), 0)


def draw(figure: Figure, results: Sequence[PartResult]) -> None:
    """Draw the task progress of each training, by the part that was left out."""
    axes = figure.subplots()
    for place, result in enumerate(results):
        axes.plot(
            result.progress,
            [place] * len(result.progress),
            linestyle="none",
            marker="o",
            color=LINES[result.without != NOTHING],
            markersize=5,
        )
    name_rows(axes, [result.without for result in results])
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("task progress in the end; a mark for each training")


@dataclass(frozen=True, kw_only=True)
class AcquisitionAblationOptions:
    """Options of this study."""

    domain: DomainName
    without: Annotated[
        list[str] | None,
        CommandOption(f"Part to leave out: {', '.join(PARTS)}. May be repeated. Default: each."),
    ] = None
    goal: Annotated[
        str | None,
        CommandOption("Name of a goal, or atoms in PDDL. Default: the domain's first."),
    ] = None
    seeds: Annotated[
        int, CommandOption("Number of trainings for each part, with seeds from 0 on.", least=1)
    ] = 3
    steps: Annotated[
        int | None, CommandOption("Environment steps of a training at most.", least=1)
    ] = None
    set: Annotated[
        list[str] | None,
        CommandOption("Setting to change in all of them, as sac.gamma=0.99. May be repeated."),
    ] = None
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: AcquisitionAblationOptions, _: Tell) -> PreparedStudy:
    """Open the domain. Checkpoints are kept until the study is done.

    Raises:
        InvalidParameterError: There is no such part, or too few steps for a round.
    """
    require_torch()
    parts = tuple(dict.fromkeys(options.without or PARTS))
    if unknown := [part for part in parts if part not in PARTS]:
        raise InvalidParameterError(
            f"--without {unknown[0]!r}: there is no such part; there are {', '.join(PARTS)}"
        )
    domain = acquirable(options.domain, options.preset)
    request = AcquisitionRequest(
        domain, options.output, options.output, goal=options.goal, changes=options.set or (),
        steps=options.steps,
    )  # fmt: skip
    settings = request.chosen_settings()
    require_budget(settings, settings.segment_steps(horizon_of(domain)))
    setup = AcquisitionSetup(domain.name, domain.preset, request.goal_or_first, settings)

    def make(runner: JobRunner) -> StudyReport:
        folder = runner.checkpoints(options.output, f"acquisition_ablation_{domain.name}")
        report = study(setup, parts, options.seeds, runner, folder)
        shutil.rmtree(folder, ignore_errors=True)  # the log has every result
        return report

    given = {
        "without": list(parts) if options.without else None,
        "goal": options.goal,
        "steps": options.steps,
        "set": options.set,
        "preset": domain.preset,
        "trainings": None,
    }
    named = {
        "goal": request.goal_or_first,
        "preset": domain.preset,
        "seeds": options.seeds,
        "trainings": options.seeds * len(parts),
    }
    return PreparedStudy(named, make, given)


STUDY = Study(
    "acquisition_ablation",
    help="LG-SAIL §4: what parts of acquiring skills are worth: learn without each.",
    example="slap study acquisition_ablation stack_at_target --seeds 1 --steps 30000",
    options=AcquisitionAblationOptions,
    prepare=prepare,
    costs="learning",
)
