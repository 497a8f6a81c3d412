# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a language model's rewards are worth when it sees the metrics' source, or their heads alone.

LG-SAIL Table 3 and Figure 7.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.proposals.complaints import REWARD_ERROR_GROUPS, ComplaintClass
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.language.budget import BudgetLimits
from slap_ros.relational import LiftedOperator
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.model_attempts import Attempt, LanguageModel, attempt_rewards
from slap_ros.studies.lg_sail.model_options import ModelOptions, answered_by
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import PreparedStudy, Study, not_made

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FULL, HEADERS = "full", "headers"
METRICS = (FULL, HEADERS)  # what of the metrics is shown
PAPER_TASK = {FULL: 0.92, HEADERS: 0.20}  # LG-SAIL Table 3: all rewards of a task are right
PAPER_ERRORS = {FULL: 0.08, HEADERS: 0.80}  # Figure 7: tasks with an error
MEASURED = """\
In each trial the model is asked once for the reward of every hand-written operator. With *full*,
the question quotes the source of every metric; with *headers*, only names and types. A reward is
right if it passes all checks: known metrics, arguments of their types, weights from 0 to 1, and at
least one metric that an added atom rests on. *All* is the share of trials in which every reward is
right, with Wilson's 95 % interval and the paper's share in brackets. In the paper, people judge
whether a reward is right. Errors are grouped into the paper's four classes; a trial can have
several. The number of the trial is the seed of the model's sampling."""


@dataclass(frozen=True)
class RewardTrials:
    """All trials in which the same was shown.

    Args:
        metrics: What was shown of the metrics, one of :data:`METRICS`.
        attempts: Attempts, one per trial.
    """

    metrics: str
    attempts: tuple[Attempt, ...]

    def right(self, operator: str) -> int:
        """Trials in which the reward of an operator is right."""
        return sum(f"reward of {operator}" not in one.errors for one in self.attempts)

    @property
    def all_right(self) -> int:
        """Trials in which every reward is right."""
        return sum(one.passed for one in self.attempts)

    @property
    def groups(self) -> Counter[str]:
        """Trials with an error of each of the paper's classes."""
        return Counter(group for one in self.attempts for group in error_groups(one))

    def as_json(self, operators: Sequence[str]) -> dict[str, Any]:
        """The figures for these operators, and every attempt."""
        return {
            "metrics": self.metrics,
            "all_right": self.all_right,
            "right": {name: self.right(name) for name in operators},
            "errors": dict(sorted(self.groups.items())),
            "attempts": [asdict(attempt) for attempt in self.attempts],
        }


def error_groups(attempt: Attempt) -> set[str]:
    """The paper's classes of the errors of an attempt; what is in none goes under its own name."""
    kinds = {ComplaintClass(kind) for kinds in attempt.errors.values() for kind in kinds}
    found = {str(group) for group, members in REWARD_ERROR_GROUPS.items() if kinds & members}
    grouped = frozenset().union(*REWARD_ERROR_GROUPS.values())
    return found | {str(kind) for kind in kinds - grouped}


def study(
    model: LanguageModel,
    problem: AcquisitionProblem,
    operators: Sequence[LiftedOperator],
    shown: Sequence[str],
    trials: int,
    runner: JobRunner,
) -> StudyReport:
    """Ask for the rewards of all operators, again and again.

    Args:
        model: Language model to ask.
        problem: Problem with the metrics to choose among.
        operators: Operators that need rewards.
        shown: What is shown of the metrics: some of :data:`METRICS`.
        trials: Number of trials for each of ``shown``.
        runner: Runner of the jobs. It keeps earlier answers. It must be in this process: models
            cannot be sent to others.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no metrics or no operators.
        InvalidCassetteError: A script answers, and no model.
        SlapError: No model can be asked.
    """
    if not (problem.metrics and operators):
        raise InvalidParameterError(
            f"domain {problem.name} has no metrics, or no operators written by hand, to ask about"
        )
    asked = {
        metrics: {
            f"{metrics}: trial {number}": (model, problem, operators, metrics, number)
            for number in range(trials)
        }
        for metrics in shown
    }
    measured = []
    for metrics, jobs in asked.items():
        attempts = runner.run(f"rewards, {metrics}", _try, Attempt.from_json, jobs)
        measured.append(RewardTrials(metrics, tuple(attempts.values())))
    names = [operator.name for operator in operators]
    return StudyReport(
        study="reward_ablation",
        source="LG-SAIL Table 3, Figure 7",
        title=f"Rewards of a language model: {problem.name}",
        measured=MEASURED,
        table=_table(measured, names),
        found={"trials": [one.as_json(names) for one in measured]},
        draw=lambda figure: draw(figure, measured, names),
        size=(6.4, 3.0),
    )


def _try(
    model: LanguageModel,
    problem: AcquisitionProblem,
    operators: Sequence[LiftedOperator],
    metrics: str,
    number: int,
) -> Attempt:
    """Ask for all rewards once.

    Args:
        model: Language model to ask.
        problem: Problem with the metrics to choose among.
        operators: Operators that need rewards.
        metrics: What is shown of the metrics, one of :data:`METRICS`.
        number: Number of the trial.
    """
    inquiry = model.inquiry(number, BudgetLimits())
    return attempt_rewards(inquiry, operators, problem, metrics == FULL)


def _table(measured: Sequence[RewardTrials], names: Sequence[str]) -> MarkdownTable:
    rows = []
    for one in measured:
        count = len(one.attempts)
        share = SuccessRate(one.all_right, count)
        rows.append(
            [
                one.metrics,
                f"{share} ({PAPER_TASK[one.metrics]:.0%})",
                *(f"{one.right(name) / count:.0%}" for name in names),
                f"{1 - one.all_right / count:.0%} ({PAPER_ERRORS[one.metrics]:.0%})",
                ", ".join(f"{group} {number}" for group, number in one.groups.most_common()) or "-",
            ]
        )
    return MarkdownTable(("metrics shown", "all", *names, "with an error", "of which"), rows)


def draw(figure: Figure, measured: Sequence[RewardTrials], names: Sequence[str]) -> None:
    """Bars of the share of right rewards, for each operator and for all.

    Args:
        figure: Figure to draw into.
        measured: Trials, one series per entry.
        names: Names of the operators.
    """
    axes = figure.subplots()
    for number, one in enumerate(measured):
        counts = [one.all_right, *(one.right(name) for name in names)]
        places = [place + (number - (len(measured) - 1) / 2) * 0.4 for place in range(len(counts))]
        heights = [count / len(one.attempts) for count in counts]
        axes.bar(places, heights, width=0.36, color=LINES[number], label=one.metrics)
    axes.set_xticks(range(len(names) + 1), ["all", *names])
    axes.set_ylim(0.0, 1.05)
    axes.set_ylabel("share of trials that are right")
    axes.legend(ncols=2, loc="lower right")
    axes.grid(visible=False, axis="x")


@dataclass(frozen=True, kw_only=True)
class RewardOptions(ModelOptions):
    """Options of this study."""

    metrics: Annotated[
        str,
        CommandOption("What the model sees of the metrics, separated by commas: full, headers."),
    ] = ",".join(METRICS)
    trials: Annotated[int, CommandOption("Number of trials per choice of --metrics.", least=1)] = 25


def prepare(options: RewardOptions, _: Tell) -> PreparedStudy:
    """Choose what is shown, and open the model.

    Raises:
        InvalidParameterError: There is no such choice of what is shown, or more than one model.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    shown = options.metrics.split(",")
    if unknown := sorted(set(shown) - set(METRICS)):
        raise InvalidParameterError(
            f"--metrics {', '.join(unknown)}: there are {', '.join(METRICS)}"
        )
    models = options.models()
    if len(models) > 1:
        raise InvalidParameterError("rewards are asked of one model: give --model once")
    opened = get_domain(options.domain, options.preset)
    written = opened.acquisition.operators if opened.acquisition else opened.operators
    ((name, model),) = models.items()
    problem = options.problem(opened, 0)
    settings = {
        "metrics": options.metrics,
        "trials": options.trials,
        "model": [name],
        "answered_by": answered_by(models),
    }
    return PreparedStudy(
        settings | options.as_settings(),
        lambda runner: options.dated(study(model, problem, written, shown, options.trials, runner)),
        options.replayed,
    )


def _summary(found: Data) -> str:
    shares = ", ".join(
        f"{one['metrics']} {one['all_right'] / len(one['attempts']):.0%}" for one in found["trials"]
    )
    return f"all rewards right: {shares}"


STUDY = Study(
    "reward_ablation",
    help="LG-SAIL Table 3, Fig. 7: rewards of a language model, and their errors.",
    example="slap study reward_ablation stow_hammer --model NAME",
    options=RewardOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        not_made(
            "LG-SAIL Table 3, Fig. 7",
            "rewards of a language model",
            "20 → 92% with the metrics' source",
            "needs a language model",
        ),
    ),
    costs="attempts",
)
