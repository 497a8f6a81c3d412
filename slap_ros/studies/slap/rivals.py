# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The other learners of the main table: trained baselines beside pure planning (SLAP Table 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.baselines import describe_baseline, require_gymnasium
from slap_ros.api.command_options import CommandOption, DomainName, Jobs
from slap_ros.api.left_out import Tell
from slap_ros.baselines.trained_baseline import TrainedBaseline
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.summary import format_spread
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup, named_tasks, not_solved, solve_task
from slap_ros.studies.figures import LINES, label
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Output, Seeds, Tasks
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_interval, plot_whole
from slap_ros.studies.slap.library_rows import Row, relative_cell
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps
from slap_ros.studies.trained_baselines import (
    BASELINES,
    baselines_in_runs,
    open_baselines,
    other_goal,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Each baseline acts in the tasks of the preset that it was trained on, until the goal holds or the
domain's step limit is reached. It does not plan. Tasks, step limits and lengths are those of
[Table 1](README.md). A task that equals an earlier one is left out, unless a policy acts with
noise, which is drawn anew; one with more objects than a policy has room for counts as failed.
Success has Wilson's 95 % interval, and length is the mean over solved tasks with the sample
standard deviation. Relative length is over tasks that pure planning solved too. Steps are
environment steps of one training, and core-hours its time of one core, on a machine that did other
work as well."""


@dataclass(frozen=True)
class BaselineRow:
    """A method under a preset, with each of its trainings.

    Args:
        row: Trials of all trainings.
        trained: What is said of each training.
    """

    row: Row
    trained: tuple[Data, ...]

    def as_json(self) -> dict[str, Any]:
        """Every figure and every trial, for the report's JSON."""
        return {**self.row.as_json(), "trained": list(self.trained)}


def study(
    domain: str,
    baselines: Mapping[str, TrainedBaseline],
    tasks: tuple[int, int, int],
    runner: JobRunner,
) -> StudyReport:
    """Let every baseline act under the preset that it was trained on.

    Args:
        domain: Name of the domain.
        baselines: Trained baselines by the names of their folders.
        tasks: Tasks per seed, number of seeds, and the first of them.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    rows: list[BaselineRow] = []
    for preset in dict.fromkeys(one.preset for one in baselines.values()):
        experiment = Experiment(get_domain(domain, preset), *tasks)
        own = {name: one for name, one in baselines.items() if one.preset == preset}
        rows += _rows(experiment, own, runner)
    return StudyReport(
        study="rivals",
        source="SLAP Table 1",
        title=f"Other learners: {domain}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [_cells(row) for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: _draw(figure, rows),
        size=(7.0, 0.6 + 0.4 * len(rows)),
    )


def _rows(
    experiment: Experiment, baselines: Mapping[str, TrainedBaseline], runner: JobRunner
) -> list[BaselineRow]:
    """The rows of one preset, pure planning first, then a row per method."""
    from slap_ros.baselines.trials import try_baseline

    preset, distinct = experiment.domain.preset, experiment.without_repetitions()
    setup = PlanningSetup(DomainChoice.of(experiment.domain), experiment.planner, PURE_PLANNING)
    tasks = named_tasks(distinct)
    planned = {f"{preset}, planning: {name}": (setup, *task) for name, task in tasks.items()}
    pure = tuple(runner.run(f"{preset}, planning", solve_task, Trial.from_json, planned).values())
    rows = [BaselineRow(Row.of(distinct, PURE_PLANNING.name, {"": pure}, pure), ())]
    for method in dict.fromkeys(one.name for one in baselines.values()):
        own = {name: one for name, one in baselines.items() if one.name == method}
        tried = experiment if any(one.noise for one in own.values()) else distinct
        jobs = {
            folder: {
                f"{preset}, {folder}, {one.digest}: {name}": (one, preset, None, *task)
                for name, task in named_tasks(tried).items()
            }
            for folder, one in own.items()
        }
        what = f"{preset}, {method}"
        found = runner.run(what, try_baseline, Trial.from_json, *jobs.values(), failure=not_solved)
        trials = {folder: tuple(found[name] for name in batch) for folder, batch in jobs.items()}
        trained = tuple({"name": name, **describe_baseline(one)} for name, one in own.items())
        planning = _repeated(pure, tried)
        rows.append(BaselineRow(Row.of(tried, method, trials, planning), trained))
    return rows


def _repeated(pure: Sequence[Trial], experiment: Experiment) -> tuple[Trial, ...]:
    """Trials of planning for all tasks, of which it solved those that equal no earlier one."""
    known = {(trial.seed, trial.index): trial for trial in pure}
    return tuple(
        replace(known[first], seed=seed, index=index)
        for (seed, index), first in experiment.first_equals().items()
    )


COLUMNS = (
    "preset",
    "tasks × trainings",
    "approach",
    "success [95 %]",
    "plan length [steps]",
    "relative [95 %]",
    "training [steps]",
    "training [core-hours]",
)


def _cells(one: BaselineRow) -> list[str]:
    """A row of the page's table."""
    row = one.row
    return [
        f"`{row.preset}`",
        f"{row.tasks} × {len(one.trained)}" if one.trained else f"{row.tasks}",
        label(row.approach),
        str(row.solved),
        format_spread(row.length, 1),
        relative_cell(row),
        _mean(one.trained, "environment_steps", 1.0, ",.0f"),
        _mean(one.trained, "cpu_s", 3600.0, ".2f"),
    ]


def _mean(trained: Sequence[Data], name: str, unit: float, digits: str) -> str:
    """The mean of a figure over all trainings, for a table; a dash where there are none."""
    if not trained:
        return "-"
    return format(fmean(float(one[name]) for one in trained) / unit, digits)


def _draw(figure: Figure, rows: Sequence[BaselineRow]) -> None:
    """The success of each row, with its interval."""
    axes = figure.subplots()
    name_rows(axes, [f"{label(one.row.approach)}, {one.row.preset}" for one in rows])
    for place, one in enumerate(rows):
        plot_interval(axes, place, one.row.solved.interval, LINES[0])
        plot_whole(axes, place, 100 * one.row.solved.share)
    axes.set_xlim(-2, 102)
    axes.set_xlabel("tasks solved, %")


def _summary(found: Data) -> str:
    parts = []
    for row in found["rows"]:
        if row["approach"] != PURE_PLANNING.name:
            steps = format_steps(row["plan_length"])
            solved = "" if steps == "-" else f" in {steps} steps"
            parts.append(
                f"`{row['preset']}`: {label(row['approach'])} {row['success_rate']:.0%}{solved}"
            )
    return "; ".join(parts)


@dataclass(frozen=True, kw_only=True)
class RivalsOptions:
    """Options of this study."""

    domain: DomainName
    against: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder of a baseline that `slap baseline train` made. May be repeated: trainings of "
            f"the same method share a row. Default: all of {BASELINES}/DOMAIN-*.",
            metavar="FOLDER",
        ),
    ] = None
    tasks: Tasks = 10
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: RivalsOptions, tell: Tell) -> PreparedStudy:
    """Open every baseline; one that cannot be used is left out, and said.

    Raises:
        InvalidParameterError: None can be used, or Gymnasium is not installed.
    """
    require_gymnasium()
    domain = get_domain(options.domain)
    folders = options.against or baselines_in_runs(options.domain)
    baselines = open_baselines(folders, domain, other_goal, tell)
    if not baselines:
        raise InvalidParameterError(
            f"there is no baseline of {options.domain} to compare with; `slap baseline train "
            f"METHOD {options.domain}` makes one"
        )
    own = {"tasks": options.tasks, "seeds": options.seeds, "first_seed": options.first_seed}
    described = [
        {"name": name, "digest": one.digest, "method": one.method, "preset": one.preset}
        for name, one in baselines.items()
    ]
    tasks = (options.tasks, options.seeds, options.first_seed)
    return PreparedStudy(
        {**own, "baselines": described},
        lambda runner: study(options.domain, baselines, tasks, runner),
        {"against": folders, **own},
    )


STUDY = Study(
    "rivals",
    help="SLAP Table 1: success and length of other learners, beside pure planning.",
    example="slap study rivals obstacle2d",
    options=RivalsOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 1",
            "other learners: PPO, SAC+HER, hierarchical RL, SOL",
            SLAP_DOMAINS,
            {
                "": "0%",
                "obstacle2d": "PPO, SAC+HER 0%; hierarchical RL 100% in 25.3 steps, SOL in 24.9",
            },
        ),
    ),
)
