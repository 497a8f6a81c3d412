# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the terms of a learner's interface that were made by hand are worth.

The same shortcut is learned from the same starts with all terms, without each, and with none.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset, Samples
from slap_ros.api.jobs import require_torch
from slap_ros.api.left_out import Tell
from slap_ros.api.shortcut_choice import SAMPLES, sampling
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, UnsolvableError
from slap_ros.evaluation.approaches import PURE_PLANNING, approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.policies.learner_interface import learner_interface, without
from slap_ros.shortcuts import jobs, learning_attempt
from slap_ros.shortcuts.candidate_groups import rank
from slap_ros.shortcuts.exploration_result import ExplorationResult, mean_operator_steps
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.settings import OURS, TrainingSettings
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.figures import APPROACH_STYLES, LINES, label
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOTHING = "nothing"  # is left out: what ships was learned so
SETTINGS = "training settings"  # of the domain are left out: the general ones instead
PURE = "pure planning"
SHOWN = ("slap_1_sample", "slap")
MEASURED = """\
Each row leaves out the terms that it names, and nothing else. [What is made by
hand](../by-hand.md) describes the terms. Without the *training settings* of
this domain, those of every domain are used. For each of {trainings} seeds, the most promising
shortcut is found once. Every row learns it from the same starts, with {steps} environment steps.
Success is the share of the last {recent} episodes of training that reached the target, with the
noise of the policy. Steps are those of successful episodes. Length is the length of executed plans
relative to pure planning on the same {tasks} tasks. A task that was not solved counts only in the
column *solved*. With all samples, search in the planner's model makes up for much that a policy has
not learned. So the column for 1 sample shows best what a term is worth for learning.

Means ± sample standard deviations are over the seeds of training. With so few seeds, a difference
of less than two standard deviations says nothing. This is one domain and one budget of steps: a
term that is worth nothing here may be worth much elsewhere."""


@dataclass(frozen=True, kw_only=True)
class AblatedChoice(DomainChoice):
    """A domain whose learner's interface leaves a term out, made where it is needed.

    Args:
        term: Name in ``Learning.ablations``; :data:`NOTHING` and :data:`SETTINGS` leave the
            interface as it is.
    """

    term: str

    @property
    def identity(self) -> dict[str, str]:
        """See :attr:`slap_ros.skills.domain_choice.DomainChoice.identity`."""
        return {**super().identity, "without": self.term}

    def make(self) -> Domain:
        """See :meth:`slap_ros.skills.domain_choice.DomainChoice.make`."""
        domain = super().make()
        return domain if self.term in (NOTHING, SETTINGS) else without(domain, self.term)


@dataclass(frozen=True)
class AblationSetup:
    """What is learned, and how it is tried.

    Args:
        domain: Name of the domain.
        preset: Name of the domain's preset.
        steps: Environment steps of each training, all stages together; None: those of the domain's
            settings.
        tasks: Number of tasks that are planned for with what was learned.
        first_seed: Seed of the tasks that are planned for.
        sampling: Settings of how shortcuts are tried out in the model.
    """

    domain: str
    preset: str
    steps: int | None
    tasks: int
    first_seed: int
    sampling: Sampling

    def tasks_of(self, seed: int, term: str = NOTHING) -> TaskDistribution:
        """The tasks of a training without a term."""
        return TaskDistribution(AblatedChoice(self.domain, self.preset, term=term), seed)

    def settings(self, term: str) -> TrainingSettings:
        """Hyper-parameters of learning without a term; the steps are the same for all."""
        own = training_settings("ours", get_domain(self.domain, self.preset))
        steps = own.total_steps if self.steps is None else self.steps
        return (OURS if term == SETTINGS else own).with_total_steps(steps)

    def terms(self) -> tuple[str, ...]:
        """What can be left out, :data:`NOTHING` first.

        Raises:
            InvalidParameterError: The domain names nothing.
            InvalidDomainError: Nothing can be learned in it.
        """
        domain = get_domain(self.domain, self.preset)
        learner_interface(domain)  # or an error that says that there is none
        assert domain.learning is not None
        if not domain.learning.ablations:
            raise InvalidParameterError(
                f"domain {self.domain} does not say what in its learner's interface was made by "
                "hand; see Learning.ablations"
            )
        settings = (SETTINGS,) if "ours" in domain.learning.settings else ()
        return (NOTHING, *domain.learning.ablations, *settings)


@dataclass(frozen=True)
class TermResult:
    """What was learned without a term, as JSON data, one entry per training."""

    term: str
    trainings: tuple[Mapping[str, Any], ...]
    pure: tuple[Mapping[str, Any], ...]  # pure planning's trials

    @property
    def success(self) -> Spread:
        """Share of episodes, over trainings."""
        return Spread.of([float(training["success"]) for training in self.trainings])

    @property
    def steps(self) -> Spread | None:
        """Environment steps of successful episodes, over the trainings that had any."""
        known = [float(one["steps"]) for one in self.trainings if one["success"] > 0.0]
        return Spread.of(known) if known else None

    def relative(self, approach: str) -> list[float]:
        """Length relative to pure planning on tasks that both solved, of each training."""
        found = []
        for training in self.trainings:
            both = [
                (own["steps"], other["steps"])
                for own, other in zip(training[approach], self.pure, strict=True)
                if own["success"] and other["success"]
            ]
            if both:
                found.append(sum(own for own, _ in both) / sum(other for _, other in both))
        return found

    @property
    def solved(self) -> float:
        """Share of tasks that were solved with all samples."""
        return fmean(trial["success"] for one in self.trainings for trial in one["slap"])


def study(
    setup: AblationSetup,
    terms: Sequence[str],
    trainings: int,
    runner: JobRunner,
    folder: Path,
) -> StudyReport:
    """Learn with and without each term, and plan with what was learned.

    Args:
        setup: Settings of learning and of planning.
        terms: Terms to leave out, of :meth:`AblationSetup.terms`.
        trainings: Number of trainings per term, with seeds from 0 on.
        runner: Runner of the jobs.
        folder: Folder for checkpoints.

    Returns:
        The report.

    Raises:
        InvalidParameterError: A term is unknown.
        UnsolvableError: There is nothing to learn with one of the seeds.
    """
    if unknown := [term for term in terms if term not in setup.terms()]:
        raise InvalidParameterError(
            f"{setup.domain} has no term {unknown[0]!r}; there are {', '.join(setup.terms())}"
        )
    seeds = range(trainings)
    looked_for = {f"problem {seed}": (setup, seed) for seed in seeds}
    problems = runner.run("what to learn", find_problem, dict, looked_for)
    planned = runner.run("pure planning", plan_purely, list, {PURE: (setup,)})
    learning = {
        f"{term} {seed}": (setup, term, seed, problems[f"problem {seed}"], str(folder))
        for term in terms
        for seed in seeds
    }
    learned = runner.run("learning", learn_without, dict, learning)
    results = [
        TermResult(term, tuple(learned[f"{term} {seed}"] for seed in seeds), tuple(planned[PURE]))
        for term in terms
    ]
    steps = setup.settings(NOTHING).total_steps
    return StudyReport(
        study="ablation",
        source="",
        title=f"What is made by hand: {setup.domain}",
        measured=MEASURED.format(trainings=trainings, steps=steps, recent=200, tasks=setup.tasks),
        table=_table(results),
        found={
            "environment_steps": steps,
            "shortcuts": [problem["name"] for problem in problems.values()],
            "pure_planning": planned[PURE],
            "terms": [{"without": one.term, "trainings": one.trainings} for one in results],
        },
        draw=lambda figure: draw(figure, results),
        size=(6.4, 0.8 + 0.42 * len(results)),
    )


def find_problem(setup: AblationSetup, seed: int) -> dict[str, Any]:
    """The most promising shortcut of a training that can begin somewhere, and its starts.

    Args:
        setup: Settings of learning and of planning.
        seed: Seed of the training.

    Returns:
        Name, signature and starts, as JSON.

    Raises:
        UnsolvableError: There is none.
    """
    distribution = setup.tasks_of(seed)
    settings = setup.settings(NOTHING)
    tasks = range(settings.exploration.tasks)
    found = [jobs.try_to_explore(distribution, index, settings.exploration) for index in tasks]
    explored = [ExplorationResult.from_json(one) for one in found if not isinstance(one, str)]
    operator_steps = mean_operator_steps(explored)
    for group in rank(explored) if explored else ():
        signature, path = group.signature, group.operator_path
        starts = [
            jobs.start(distribution, index, signature, path, operator_steps)
            for index in range(settings.starts)
        ]
        if any(starts):
            return {
                "name": signature.name,
                "signature": signature.as_json(),
                "starts": [start for start in starts if start is not None],
            }
    raise UnsolvableError(
        f"no shortcut to learn was found in the {len(tasks)} tasks that training "
        f"{seed} explores in {setup.domain}"
    )


def plan_purely(setup: AblationSetup) -> list[dict[str, Any]]:
    """Whether pure planning solves each task, and in how many environment steps."""
    domain = get_domain(setup.domain, setup.preset)
    episodes = [
        solve(domain, domain.task(setup.first_seed, index), PURE_PLANNING)
        for index in range(setup.tasks)
    ]
    return [{"success": one.success, "steps": one.plan_length} for one in episodes]


def learn_without(
    setup: AblationSetup, term: str, seed: int, problem: Mapping[str, Any], folder: str
) -> dict[str, Any]:
    """Learn a shortcut without a term, and plan with it.

    Args:
        setup: Settings of learning and of planning.
        term: Term that is left out.
        seed: Seed of the training.
        problem: Problem that :func:`find_problem` found for that seed.
        folder: Folder for checkpoints.

    Returns:
        Success and steps in training, and how each task was solved by each approach.
    """
    distribution = setup.tasks_of(seed, term)
    attempt = learning_attempt.LearningAttempt(
        distribution,
        Signature.from_json(problem["signature"]),
        tuple(StartRecord.from_json(start) for start in problem["starts"]),
        setup.settings(term),
        str(Path(folder) / f"{term} {seed}" / problem["name"]),
    )
    shortcut = learning_attempt.learn(attempt, processes=1)
    domain = distribution.make_domain()
    library = ShortcutLibrary(setup.domain, (shortcut,), {})
    found: dict[str, Any] = {
        "success": shortcut.record["success"],
        "steps": shortcut.record["length"],
        "cpu_seconds": shortcut.record["cpu_s"],
    }
    for approach in approaches(library, setup.sampling)[1:]:
        episodes = [
            solve(domain, domain.task(setup.first_seed, index), approach)
            for index in range(setup.tasks)
        ]
        found[approach.name] = [{"success": e.success, "steps": e.plan_length} for e in episodes]
    return found


def _table(results: Sequence[TermResult]) -> MarkdownTable:
    columns = (
        "without",
        "success in training",
        "steps",
        *(f"length, {label(approach)}" for approach in SHOWN),
        "solved",
    )
    return MarkdownTable(columns, [list(_row(result)) for result in results])


def _row(result: TermResult) -> Iterator[str]:
    yield result.term
    yield format_spread(result.success, 2)
    yield format_spread(result.steps, 1)
    for approach in SHOWN:
        relative = result.relative(approach)
        yield format_spread(Spread.of(relative) if relative else None, 2)
    yield f"{result.solved:.0%}"


def draw(figure: Figure, results: Sequence[TermResult]) -> None:
    """Draw the relative length of each training, by what was left out."""
    axes = figure.subplots()
    for number, approach in enumerate(SHOWN):
        style = APPROACH_STYLES[approach]
        for place, result in enumerate(results):
            relative = result.relative(approach)
            axes.plot(
                relative,
                [place + 0.2 * (number - 0.5)] * len(relative),
                linestyle="none",
                marker=style.marker,
                color=LINES[number],
                markersize=5,
                label=style.label if place == 0 else None,
            )
    name_rows(axes, [result.term for result in results])
    axes.set_xlabel("plan length relative to pure planning; a mark for each training")
    figure.legend(loc="outside upper center", ncols=len(SHOWN))


@dataclass(frozen=True, kw_only=True)
class AblationOptions:
    """Options of this study."""

    domain: DomainName
    term: Annotated[
        list[str] | None,
        CommandOption("Term to leave out. May be repeated. Default: each term, and all together."),
    ] = None
    trainings: Annotated[
        int, CommandOption("Number of trainings per term, with seeds from 0 on.", least=1)
    ] = 3
    steps: Annotated[
        int | None,
        CommandOption(
            "Environment steps of a training. Default: as in the domain's settings.", least=1
        ),
    ] = None
    tasks: Annotated[
        int, CommandOption("Number of tasks to plan with what was learned.", least=1)
    ] = 20
    seed: FreshSeed = FRESH_SEED
    samples: Samples = SAMPLES
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: AblationOptions, _: Tell) -> PreparedStudy:
    """Open the domain. Checkpoints are kept beside the report until the study is done."""
    require_torch()
    domain, trainings = options.domain, options.trainings
    preset = get_domain(domain, options.preset).preset
    tried = sampling(options.samples)
    setup = AblationSetup(domain, preset, options.steps, options.tasks, options.seed, tried)
    settings = {
        "preset": preset,
        "trainings": trainings,
        "steps": options.steps,
        "tasks": options.tasks,
        "seed": options.seed,
        "samples": options.samples,
    }

    def make(runner: JobRunner) -> StudyReport:
        folder = runner.checkpoints(options.output, f"ablation_{domain}")
        report = study(setup, options.term or setup.terms(), trainings, runner, folder)
        shutil.rmtree(folder, ignore_errors=True)  # the log has every result
        return report

    return PreparedStudy(settings, make, {"term": options.term})


STUDY = Study(
    "ablation",
    help="What a domain's hand-made terms are worth: learn without each, and without all.",
    example="slap study ablation obstacle2d --trainings 1",
    options=AblationOptions,
    prepare=prepare,
    costs="learning",
)
