# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Other goals with the same library (SLAP Fig. 9, D.1)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.drawing.palette import MUTED
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.evaluation.experiment import Trial, solve
from slap_ros.evaluation.summary import Summary, format_spread
from slap_ros.learning.random_goals import sample_goals
from slap_ros.studies.comparison import Comparison, PlanningSetup, named_tasks
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.options import Tasks
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NamedGoal = tuple[tuple[str, tuple[str, ...]], ...]  # a goal as names, for another process

GOALS = 9  # tells the random numbers of goals from those of tasks
DOT = 20  # area of a dot in the picture, points squared
MEASURED = """\
Goals are sampled for each task. Each goal is one or two of the fluent atoms that hold in a random
node of the task's abstract graph, and not at the start. No goal is sampled twice for a task. Pure
planning and SLAP plan and execute each goal. Length is the number of environment steps executed,
mean ± sample standard deviation over solved goals. Relative length is the mean over that of pure
planning, on goals that both solved. The counts below are on these goals, too. The library was
trained for the domain's own goal. A goal for which no plan is found counts as failed: operators can
reach some abstract states that cannot be reached in the world."""


@dataclass(frozen=True)
class GoalTrials:
    """A goal, and what came of it: a trial an approach, pure planning first."""

    goal: NamedGoal
    trials: tuple[Trial, ...]

    @property
    def lengths(self) -> tuple[int, int] | None:
        """Environment steps of pure planning and of SLAP; None unless both solved it."""
        pure, slap = self.trials[0], self.trials[-1]
        return (pure.plan_length, slap.plan_length) if pure.success and slap.success else None


def study(comparison: Comparison, count: int) -> StudyReport:
    """Sample goals for each task and solve them all with every approach.

    Args:
        comparison: Approaches, and the tasks whose goals are replaced.
        count: Goals per task, fewer where a task has fewer.

    Returns:
        The report.

    Raises:
        UnsolvableError: No task has any goal that operators can reach.
    """
    jobs = {
        f"{name}, {' and '.join(_words(goal))}": (*task, goal)
        for name, task in named_tasks(comparison.experiment).items()
        for goal in _goals(comparison, *task, count)
    }
    if not jobs:
        raise UnsolvableError("operators can reach no goal in any of the tasks")
    found = comparison.attempt("goals", solve_for, Trial.from_json, jobs)
    trials = list(found.values())
    outcomes = [
        GoalTrials(goal, own)
        for (*_, goal), own in zip(jobs.values(), zip(*trials, strict=True), strict=True)
    ]
    summaries = [
        Summary.of(comparison.experiment, name, own, trials[0]) for name, own in found.items()
    ]
    return _report(comparison, outcomes, summaries)


def _report(
    comparison: Comparison, outcomes: Sequence[GoalTrials], summaries: Sequence[Summary]
) -> StudyReport:
    names = [approach.name for approach in comparison.approaches]
    return StudyReport(
        study="goals",
        source="SLAP Fig. 9",
        title=f"Other goals: {comparison.domain.name}",
        measured=f"{MEASURED}\n\n{_compared(outcomes)}",
        table=_table(len(outcomes), summaries),
        found={
            "approaches": [summary.as_row() for summary in summaries],
            "goals": [_as_json(outcome, names) for outcome in outcomes],
        },
        draw=lambda figure: draw(figure, outcomes),
        size=(4.6, 4.4),
    )


def _goals(comparison: Comparison, seed: int, index: int, count: int) -> list[NamedGoal]:
    """Goals for one task; none where its graph cannot be built."""
    domain = comparison.domain
    rng = np.random.default_rng([seed, index, GOALS])
    try:
        sampled = sample_goals(domain, domain.task(seed, index), count, rng)
    except (UnsolvableError, PlanningLimitError) as error:
        comparison.runner.progress.report_failure(
            f"seed {seed}, task {index} has no goals: {error}"
        )
        return []
    return [
        tuple((atom.predicate.name, tuple(obj.name for obj in atom.objects)) for atom in goal)
        for goal in sampled
    ]


def solve_for(setup: PlanningSetup, seed: int, index: int, goal: NamedGoal) -> Trial:
    """Solve one task for another goal.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        seed: Seed of the task.
        index: Index of the task among those of its seed.
        goal: Goal in place of the task's own.

    Returns:
        What came of it.
    """
    chosen = setup.make_domain()
    task = chosen.task(seed, index)
    space = chosen.atom_space(task.initial_state)
    atoms = frozenset(space.atom(predicate, objects) for predicate, objects in goal)
    return Trial.of(
        seed, index, solve(chosen, replace(task, goal=atoms), setup.approach, setup.planner)
    )


def _as_json(outcome: GoalTrials, names: Sequence[str]) -> dict[str, Any]:
    first = outcome.trials[0]
    whose = {"seed": first.seed, "index": first.index}
    trials = [
        {key: value for key, value in trial.as_json().items() if key not in whose}
        for trial in outcome.trials
    ]
    return {**whose, "goal": _words(outcome.goal), **dict(zip(names, trials, strict=True))}


def _words(goal: NamedGoal) -> list[str]:
    return [f"{predicate}({', '.join(objects)})" for predicate, objects in goal]


def _compared(outcomes: Sequence[GoalTrials]) -> str:
    """How often SLAP's plans are shorter, in words."""
    pairs = [outcome.lengths for outcome in outcomes if outcome.lengths is not None]
    shorter = sum(slap < pure for pure, slap in pairs)
    longer = sum(slap > pure for pure, slap in pairs)
    return (
        f"Both solved {len(pairs)} of {len(outcomes)} goals. SLAP was shorter for {shorter}, "
        f"equally long for {len(pairs) - shorter - longer} and longer for {longer}."
    )


def _table(goals: int, summaries: Sequence[Summary]) -> MarkdownTable:
    return MarkdownTable(
        ["approach", "goals", "success", "length [steps]", "relative length"],
        [
            [
                label(summary.approach),
                str(goals),
                f"{summary.success_rate:.0%}",
                format_spread(summary.plan_length, 1),
                "-" if summary.relative_length is None else f"{summary.relative_length:.2f}",
            ]
            for summary in summaries
        ],
    )


def draw(figure: Figure, outcomes: Sequence[GoalTrials]) -> None:
    """A dot for each pair of lengths, the larger the more goals have it."""
    axes = figure.subplots()
    counted = Counter(outcome.lengths for outcome in outcomes if outcome.lengths is not None)
    longest = max((max(pair) for pair in counted), default=1)
    limit = 1.08 * longest
    axes.plot([0, limit], [0, limit], color=MUTED, linewidth=1, label="as long")
    axes.scatter(
        [pure for pure, _ in counted],
        [slap for _, slap in counted],
        [DOT * count for count in counted.values()],
        color=APPROACH_STYLES["slap"].colour,
        alpha=0.6,
        linewidths=0,
        label="goals; area: how many",
    )
    axes.set_xlim(0, limit)
    axes.set_ylim(0, limit)
    axes.set_aspect("equal")
    axes.set_xlabel("length by pure planning [steps]")
    axes.set_ylabel("length with SLAP [steps]")
    axes.legend(loc="upper left")


def _summary(found: Data) -> str:
    pure, slap = found["approaches"][0], found["approaches"][-1]
    steps = f"{format_steps(pure['plan_length'])} → {format_steps(slap['plan_length'])} steps"
    return f"{slap['success_rate']:.0%}; {steps}, {len(found['goals'])} goals in all"


@dataclass(frozen=True, kw_only=True)
class GoalOptions(ComparisonOptions):
    """Options of this study; one task per seed, as each task has many goals."""

    goals: Annotated[
        int, CommandOption("Goals per task, or all if the task has fewer.", least=1)
    ] = 15
    tasks: Tasks = 1


def prepare(options: GoalOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library."""
    count = options.goals
    compared = ChosenComparison.of(options, tell, {"goals": count}).ends()
    return compared.prepare(lambda it: study(it, count))


STUDY = Study(
    "goals",
    help="SLAP Fig. 9: pure planning and SLAP for goals that the library was not trained for.",
    example="slap study goals obstacle_tower",
    options=GoalOptions,
    prepare=prepare,
    summary=_summary,
    figures=(PaperFigure("SLAP Fig. 9", "15 other goals", SLAP_DOMAINS, {"": "bars"}),),
)
