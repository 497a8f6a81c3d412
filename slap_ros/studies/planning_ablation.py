# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who plans with operators of a language model: A*, the model itself, or nobody twice.

LG-SAIL Table 2, and for several models Tables 5 and 6. An attempt asks once for a decomposition and
its operators; where these chain, the plan is A*'s or is asked for as well, once. Attempts go on
until there is a plan, or the limit of attempts is reached.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from slap_ros.acquisition.problem import AcquisitionProblem
from slap_ros.evaluation.statistics import wilson_interval
from slap_ros.language.budget import BudgetLimits
from slap_ros.studies.comparison import StudyProgress
from slap_ros.studies.figures import LINES
from slap_ros.studies.model_attempts import Attempt, LanguageModel, attempt_operators, attempt_plan
from slap_ros.studies.results import MarkdownTable, StudyReport

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEARCH, ALONE, ONE_SHOT = "language+search", "language", "one_shot"
VARIANTS = (SEARCH, ALONE, ONE_SHOT)
# LG-SAIL Tables 2 and 5: operator success, planning success, overall success, attempts.
PAPER = {
    SEARCH: (0.610, 1.000, 1.00, 1.64),
    ALONE: (0.593, 0.781, 1.00, 2.16),
    ONE_SHOT: (0.520, 0.692, 0.36, None),
}
MEASURED = """\
Each plan is a task of its own. An attempt asks the model once for the actions of the task and once
for the operator of each; *operators* is the share of attempts in which all pass their checks and
A* finds a plan with them. *Planning* is the share of plans that reach the goal, of those attempted
with such operators: A* by construction, or the model asked once. *Overall* is the share of tasks
with a plan within {attempts} attempts, or in the only attempt of one_shot. *Attempts* is their mean
number for each plan that was found. No answer is asked for again with what was wrong with it, so
that attempts are alike. The attempt's number is the seed of the model's sampling. Shares have
Wilson's 95 % interval. In brackets: the paper's, of its own model and tasks."""


@dataclass(frozen=True)
class PlanTrial:
    """A task, and the attempts that it took.

    Args:
        model: Who was asked.
        variant: Who plans.
        attempts: At operators, in order.
        plans: At plans with those that passed; none of A*'s.
        found: Whether there is a plan in the end.
    """

    model: str
    variant: str
    attempts: tuple[Attempt, ...]
    plans: tuple[Attempt, ...]
    found: bool


@dataclass(frozen=True)
class Tally:
    """What trials of a model and variant come to."""

    trials: tuple[PlanTrial, ...]

    @property
    def operators(self) -> tuple[int, int]:
        """Attempts that passed, and all."""
        attempts = [attempt for trial in self.trials for attempt in trial.attempts]
        return sum(attempt.passed for attempt in attempts), len(attempts)

    @property
    def planning(self) -> tuple[int, int]:
        """Plans that reach the goal, and those attempted with sound operators."""
        if self.trials[0].variant == SEARCH:
            sound = self.operators[0]
            return sound, sound
        plans = [plan for trial in self.trials for plan in trial.plans]
        return sum(plan.passed for plan in plans), len(plans)

    @property
    def overall(self) -> tuple[int, int]:
        """Tasks with a plan, and all."""
        return sum(trial.found for trial in self.trials), len(self.trials)

    @property
    def attempts(self) -> float | None:
        """For each plan that was found; None where none was."""
        found = self.overall[0]
        return self.operators[1] / found if found else None

    @property
    def errors(self) -> Counter[str]:
        """How often each class of error occurred."""
        every = [a for t in self.trials for a in (*t.attempts, *t.plans)]
        return Counter(kind for one in every for kinds in one.errors.values() for kind in kinds)


def expected_attempts(operators: float, planning: float) -> float:
    """How many attempts a plan takes where operators and plan succeed with these probabilities."""
    return 1.0 / (operators * planning)


def one_shot_success(operators: float, planning: float) -> float:
    """How often the first attempt gives a plan."""
    return operators * planning


def study(
    models: Mapping[str, LanguageModel],
    problems: Sequence[AcquisitionProblem],
    variants: Sequence[str],
    most_attempts: int,
    progress: StudyProgress,
) -> StudyReport:
    """Ask each model for a plan of each task, in each variant.

    Args:
        models: By name.
        problems: A task per plan.
        variants: Of :data:`VARIANTS`.
        most_attempts: For one plan.
        progress: Is called as tasks end.

    Returns:
        The report.

    Raises:
        InvalidCassetteError: A script answers, and no model.
        SlapError: No model can be asked.
    """
    progress.begin("plans", len(models) * len(variants) * len(problems))
    trials: list[PlanTrial] = []
    for asked, model in models.items():
        for variant in variants:
            for number, problem in enumerate(problems):
                attempts = 1 if variant == ONE_SHOT else most_attempts
                seeds = range(number * most_attempts, number * most_attempts + attempts)
                trials.append(_try(asked, model, variant, problem, seeds))
                progress.advance()
    tallies = {
        (asked, variant): Tally(
            tuple(t for t in trials if (t.model, t.variant) == (asked, variant))
        )
        for asked in models
        for variant in variants
    }
    return StudyReport(
        study="planning_ablation",
        source="LG-SAIL Tables 2, 5 and 6",
        title=f"Operators and plans of language models: {problems[0].name}",
        measured=MEASURED.format(attempts=most_attempts),
        table=_table(tallies),
        found={
            "tallies": [
                {
                    "model": asked,
                    "variant": variant,
                    "operators": tally.operators,
                    "planning": tally.planning,
                    "overall": tally.overall,
                    "attempts": tally.attempts,
                    "errors": dict(sorted(tally.errors.items())),
                    "trials": [asdict(trial) for trial in tally.trials],
                }
                for (asked, variant), tally in tallies.items()
            ]
        },
        draw=lambda figure: draw(figure, tallies),
        size=(6.4, 3.0),
    )


def _try(
    name: str, model: LanguageModel, variant: str, problem: AcquisitionProblem, seeds: range
) -> PlanTrial:
    attempts: list[Attempt] = []
    plans: list[Attempt] = []
    for seed in seeds:
        attempt, operators = attempt_operators(model.inquiry(seed, BudgetLimits()), problem)
        attempts.append(attempt)
        found = attempt.passed
        if attempt.passed and variant != SEARCH:
            plans.append(attempt_plan(model.inquiry(seed, BudgetLimits()), operators, problem))
            found = plans[-1].passed
        if found:
            return PlanTrial(name, variant, tuple(attempts), tuple(plans), True)
    return PlanTrial(name, variant, tuple(attempts), tuple(plans), False)


def _table(tallies: Mapping[tuple[str, str], Tally]) -> MarkdownTable:
    return MarkdownTable(
        ("model", "variant", "operators", "planning", "overall", "attempts", "most frequent error"),
        [_row(name, variant, tally) for (name, variant), tally in tallies.items()],
    )


def _row(name: str, variant: str, tally: Tally) -> list[str]:
    operators, planning, overall, attempts = PAPER[variant]
    own = "-" if tally.attempts is None else f"{tally.attempts:.2f}"
    return [
        name,
        variant,
        _share(tally.operators, operators),
        _share(tally.planning, planning),
        _share(tally.overall, overall),
        own if attempts is None else f"{own} ({attempts:.2f})",
        ", ".join(f"{kind} {count}" for kind, count in tally.errors.most_common(2)) or "-",
    ]


def _share(counts: tuple[int, int], paper: float) -> str:
    good, every = counts
    if not every:
        return f"- ({paper:.0%})"
    within = wilson_interval(good, every)
    return f"{good / every:.0%} [{within.low:.0%}, {within.high:.0%}] ({paper:.0%})"


def draw(figure: Figure, tallies: Mapping[tuple[str, str], Tally]) -> None:
    """Bars of the three shares, for each model and variant."""
    axes = figure.subplots()
    shares = ("operators", "planning", "overall")
    for number, name in enumerate(shares):
        counts = [getattr(tally, name) for tally in tallies.values()]
        places = [place + (number - 1) * 0.25 for place in range(len(counts))]
        heights = [good / every if every else 0.0 for good, every in counts]
        axes.bar(places, heights, width=0.23, color=LINES[number], label=name)
    axes.set_xticks(
        range(len(tallies)), [f"{variant}\n{name}" for name, variant in tallies], fontsize=8
    )
    axes.set_ylim(0.0, 1.05)
    axes.set_ylabel("share")
    axes.legend(ncols=3, loc="lower right")
    axes.grid(visible=False, axis="x")
