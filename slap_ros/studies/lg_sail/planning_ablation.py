# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who plans with operators of a language model: A*, the model itself, or nobody twice.

LG-SAIL Table 2. An attempt asks once for a decomposition and
its operators; where these chain, the plan is A*'s or is asked for as well, once. Attempts go on
until there is a plan, or the limit of attempts is reached.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import process_time
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.language.budget import BudgetLimits
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.model_attempts import (
    Attempt,
    LanguageModel,
    attempt_operators,
    attempt_plan,
)
from slap_ros.studies.lg_sail.model_options import ModelOptions, answered_by
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import PreparedStudy, Study, not_made

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEARCH, ALONE, ONE_SHOT = "language+search", "language", "one_shot"
VARIANTS = (SEARCH, ALONE, ONE_SHOT)
PLANS = 25  # of a language model
# LG-SAIL Tables 2 and 5: operator success, planning success, overall success, attempts.
PAPER = {
    SEARCH: (0.610, 1.000, 1.00, 1.64),
    ALONE: (0.593, 0.781, 1.00, 2.16),
    ONE_SHOT: (0.520, 0.692, 0.36, None),
}
COSTS = ("tokens", "seconds", "processor_seconds")  # of an attempt
MEASURED = """\
Each plan is for a task of its own. An attempt asks the model once for the actions of the task, and
once for the operator of each action. It ends with the first answer that does not pass its checks.
*Operators* is the share of attempts in which all answers pass and A* finds a plan with them.
*Planning* is the share of plans that reach the goal, among attempts with such operators. A* always
reaches it, by construction; the model is asked once. *Overall* is the share of tasks with a plan
within {attempts} attempts, or in the only attempt of one_shot. *Attempts* is the mean number of
attempts for each plan that was found. No question says what was wrong with an earlier answer, so
all attempts are alike. The number of the attempt is the seed of the model's sampling. *Seconds* are
the time that an attempt waited for answers, on a machine that may have been busy, and the time of
the processor in this process: almost none where a server answers. Shares have Wilson's 95 %
interval. Numbers in brackets, and lines in the picture, are the paper's, for its own model and
tasks."""
FEW = """

**Plans: {plans}; wanted: {wanted}.** The interval of *overall* shows how little so few plans say.
The same command with `--plans {wanted}` makes all of them."""


@dataclass(frozen=True)
class PlanTrial:
    """A task, and the attempts that it took.

    Args:
        model: Name of the model that was asked.
        variant: Name of the variant, which says what plans.
        attempts: Attempts at operators, in order.
        plans: Attempts at plans with operators that passed; none where A* plans.
        found: Whether there is a plan in the end.
        cpu_seconds: CPU time of this process for the trial, with that of a model in it, s.
    """

    model: str
    variant: str
    attempts: tuple[Attempt, ...]
    plans: tuple[Attempt, ...]
    found: bool
    cpu_seconds: float

    @property
    def every(self) -> tuple[Attempt, ...]:
        """Attempts at operators and at plans."""
        return self.attempts + self.plans

    def as_json(self) -> dict[str, Any]:
        """The trial in the report: how each attempt ended, and what all of them cost."""
        return {
            "found": self.found,
            "attempts": [attempt.verdict for attempt in self.attempts],
            "plans": [plan.verdict for plan in self.plans],
            "tokens": sum(one.tokens for one in self.every),
            "seconds": round(sum(one.seconds for one in self.every), 1),
            "cpu_seconds": self.cpu_seconds,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> PlanTrial:
        """The trial that :func:`dataclasses.asdict` made such data of."""
        attempts, plans = (
            tuple(map(Attempt.from_json, data[name])) for name in ("attempts", "plans")
        )
        return cls(**{**data, "attempts": attempts, "plans": plans})


@dataclass(frozen=True)
class PlanTrials:
    """What trials of a model and variant come to."""

    trials: tuple[PlanTrial, ...]

    @property
    def operators(self) -> tuple[int, int]:
        """Number of attempts that passed, and of all attempts."""
        attempts = [attempt for trial in self.trials for attempt in trial.attempts]
        return sum(attempt.passed for attempt in attempts), len(attempts)

    @property
    def planning(self) -> tuple[int, int]:
        """Number of plans that reach the goal, and of plans attempted with sound operators."""
        if self.trials[0].variant == SEARCH:
            sound = self.operators[0]
            return sound, sound
        plans = [plan for trial in self.trials for plan in trial.plans]
        return sum(plan.passed for plan in plans), len(plans)

    @property
    def overall(self) -> tuple[int, int]:
        """Number of tasks with a plan, and of all tasks."""
        return sum(trial.found for trial in self.trials), len(self.trials)

    @property
    def attempts(self) -> float | None:
        """Number of attempts for each plan that was found; None where none was."""
        found = self.overall[0]
        return self.operators[1] / found if found else None

    @property
    def errors(self) -> Counter[str]:
        """How often each class of error occurred."""
        errors = [one.errors for trial in self.trials for one in trial.every]
        return Counter(kind for one in errors for kinds in one.values() for kind in kinds)

    @property
    def cost(self) -> tuple[float, float, float]:
        """Mean cost of an attempt: tokens, seconds of waiting, CPU seconds."""
        every = [one for trial in self.trials for one in trial.every]
        sums = (
            sum(one.tokens for one in every),
            sum(one.seconds for one in every),
            sum(trial.cpu_seconds for trial in self.trials),
        )
        tokens, waited, worked = (total / self.operators[1] for total in sums)
        return tokens, waited, worked

    def as_json(self) -> dict[str, Any]:
        """The figures, and every trial."""
        return {
            "operators": self.operators,
            "planning": self.planning,
            "overall": self.overall,
            "attempts": self.attempts,
            "errors": dict(sorted(self.errors.items())),
            "cost": dict(zip(COSTS, self.cost, strict=True)),
            "trials": [trial.as_json() for trial in self.trials],
        }


def study(
    models: Mapping[str, LanguageModel],
    problems: Sequence[AcquisitionProblem],
    variants: Sequence[str],
    most_attempts: int,
    runner: JobRunner,
) -> StudyReport:
    """Ask each model for a plan of each task, in each variant.

    Args:
        models: Language models by name.
        problems: Problems, one per plan.
        variants: Names of variants, of :data:`VARIANTS`.
        most_attempts: Largest number of attempts at one plan.
        runner: Runner of the jobs. It keeps earlier answers. It must be in this process: models
            cannot be sent to others.

    Returns:
        The report.

    Raises:
        InvalidCassetteError: A script answers, and no model.
        SlapError: No model can be asked.
    """
    jobs = {}
    for asked, model in models.items():
        for variant in variants:
            for number, problem in enumerate(problems):
                attempts = 1 if variant == ONE_SHOT else most_attempts
                seeds = range(number * most_attempts, number * most_attempts + attempts)
                name = f"{asked}, {variant}: plan {number}"
                jobs[name] = (asked, model, variant, problem, seeds)
    trials = runner.run("plans", _try, PlanTrial.from_json, jobs).values()
    tallies = {
        (asked, variant): PlanTrials(
            tuple(t for t in trials if (t.model, t.variant) == (asked, variant))
        )
        for asked in models
        for variant in variants
    }
    return StudyReport(
        study="planning_ablation",
        source="LG-SAIL Tables 2, 5 and 6",
        title=f"Operators and plans of language models: {problems[0].name}",
        measured=MEASURED.format(attempts=most_attempts) + _few(len(problems)),
        table=_table(tallies),
        found={
            "tallies": [
                {"model": asked, "variant": variant} | tally.as_json()
                for (asked, variant), tally in tallies.items()
            ]
        },
        draw=lambda figure: draw(figure, tallies),
        size=(6.4, 3.0),
    )


def _try(
    name: str, model: LanguageModel, variant: str, problem: AcquisitionProblem, seeds: range
) -> PlanTrial:
    began = process_time()
    attempts: list[Attempt] = []
    plans: list[Attempt] = []
    found = False
    for seed in seeds:
        attempt, operators = attempt_operators(model.inquiry(seed, BudgetLimits()), problem)
        attempts.append(attempt)
        found = attempt.passed
        if attempt.passed and variant != SEARCH:
            plans.append(attempt_plan(model.inquiry(seed, BudgetLimits()), operators, problem))
            found = plans[-1].passed
        if found:
            break
    worked = round(process_time() - began, 2)
    return PlanTrial(name, variant, tuple(attempts), tuple(plans), found, worked)


def _few(plans: int) -> str:
    """What the page has to say of the number of plans."""
    return FEW.format(plans=plans, wanted=PLANS) if plans < PLANS else ""


def _table(tallies: Mapping[tuple[str, str], PlanTrials]) -> MarkdownTable:
    return MarkdownTable(
        (
            "model",
            "variant",
            "operators",
            "planning",
            "overall",
            "attempts",
            "tokens of an attempt",
            "seconds of an attempt",
            "most frequent errors",
        ),
        [_row(name, variant, tally) for (name, variant), tally in tallies.items()],
    )


def _row(name: str, variant: str, tally: PlanTrials) -> list[str]:
    operators, planning, overall, attempts = PAPER[variant]
    own = "-" if tally.attempts is None else f"{tally.attempts:.2f}"
    tokens, waited, worked = tally.cost
    return [
        name,
        variant,
        _share(tally.operators, operators),
        _share(tally.planning, planning),
        _share(tally.overall, overall),
        own if attempts is None else f"{own} ({attempts:.2f})",
        f"{tokens:.0f}",
        f"{waited:.1f} waited, {worked:.1f} of the processor",
        ", ".join(f"{kind} {count}" for kind, count in tally.errors.most_common(3)) or "-",
    ]


def _share(counts: tuple[int, int], paper: float) -> str:
    good, every = counts
    if not every:
        return f"- ({paper:.0%})"
    return f"{SuccessRate(good, every)} ({paper:.0%})"


def draw(figure: Figure, tallies: Mapping[tuple[str, str], PlanTrials]) -> None:
    """Bars of the three shares with their intervals, and the paper's as lines."""
    axes = figure.subplots()
    for number, name in enumerate(("operators", "planning", "overall")):
        for group, ((_, variant), tally) in enumerate(tallies.items()):
            place = group + (number - 1) * 0.25
            paper = PAPER[variant][:3][number]
            axes.hlines(paper, place - 0.11, place + 0.11, color="0.3")
            good, every = getattr(tally, name)
            if every:
                rate = SuccessRate(good, every)
                share, within = rate.share, rate.interval
                apart = [[max(share - within.low, 0.0)], [max(within.high - share, 0.0)]]
                axes.bar(place, share, 0.23, color=LINES[number], yerr=apart, capsize=3)
        axes.bar(0, 0, color=LINES[number], label=name)
    axes.set_xticks(
        range(len(tallies)), [f"{variant}\n{name}" for name, variant in tallies], fontsize=8
    )
    axes.set_ylim(0.0, 1.25)  # the legend is above the bars
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_ylabel("share")
    axes.plot([], color="0.3", label="the paper's")
    axes.legend(ncols=4, loc="upper center")
    axes.grid(visible=False, axis="x")


def summary(found: Data) -> str:
    """Share of good operators and of tasks with a plan, for each model and variant."""
    return "; ".join(
        f"{one['model']}, {one['variant']}: operators {_percent(one['operators'])}, "
        f"overall {_percent(one['overall'])}"
        for one in found["tallies"]
    )


def _percent(counts: Sequence[int]) -> str:
    good, every = counts
    return f"{good / every:.0%}"


Plans = Annotated[int, CommandOption("Number of tasks to plan.", least=1)]
Attempts = Annotated[
    int, CommandOption("Maximum number of attempts at operators, per plan.", least=1)
]


@dataclass(frozen=True, kw_only=True)
class PlanningOptions(ModelOptions):
    """How much a model is asked."""

    plans: Plans = PLANS
    attempts: Attempts = 10


@dataclass(frozen=True, kw_only=True)
class VariantOptions(PlanningOptions):
    """Options of the study of what plans with a model's operators."""

    variants: Annotated[
        str,
        CommandOption("Ways to plan, separated by commas: language+search, language, one_shot."),
    ] = ",".join(VARIANTS)


def prepare(options: VariantOptions, _: Tell) -> PreparedStudy:
    """Choose who plans, and open the models.

    Raises:
        InvalidParameterError: There is no such variant, or a model is named twice.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    chosen = options.variants.split(",")
    if unknown := sorted(set(chosen) - set(VARIANTS)):
        raise InvalidParameterError(
            f"--variants {', '.join(unknown)}: there are {', '.join(VARIANTS)}"
        )
    return prepare_asking(options, chosen, {"variants": ",".join(chosen)})


def prepare_asking(options: PlanningOptions, variants: Sequence[str], given: Data) -> PreparedStudy:
    """Open the models.

    Args:
        options: Which models are asked, and how much.
        variants: Names of what plans with their operators.
        given: Further options of the command.

    Returns:
        The study, ready to be made.

    Raises:
        InvalidParameterError: A model is named twice.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    models = options.models()
    opened = get_domain(options.domain, options.preset)
    problems = [options.problem(opened, index) for index in range(options.plans)]
    settings = {
        **given,
        "plans": options.plans,
        "attempts": options.attempts,
        "model": [*models],
        "answered_by": answered_by(models),
    }
    return PreparedStudy(
        settings | options.as_settings(),
        lambda runner: options.dated(study(models, problems, variants, options.attempts, runner)),
        options.replayed,
    )


STUDY = Study(
    "planning_ablation",
    help="LG-SAIL Table 2: operators of a language model; A* or the model plans with them.",
    example="slap study planning_ablation stow_hammer --model NAME",
    options=VariantOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        not_made(
            "LG-SAIL Table 2",
            "operators and plans of a language model",
            "operators 61%, with search 100% overall, 1.64 attempts",
            "needs a language model",
        ),
    ),
    costs="attempts",
)
