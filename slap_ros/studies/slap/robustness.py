# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP where the world is not as plans take it to be: what three studies share.

Plans are made with the planner's model and executed in the world. Where execution diverges, the
planner plans again, from where the robot is then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset, Samples
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.api.shortcut_choice import SAMPLES, sampling
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING, approaches
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.perception import NoisyPerceiver, Quality
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.planning.partial import PartialPlanner
from slap_ros.relational import State
from slap_ros.shortcuts.shipped import shipped_libraries
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Libraries, Output, Seeds, Tasks
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_interval
from slap_ros.studies.slap.library_rows import (
    PURELY,
    PlannedWay,
    Row,
    TrainedLibrary,
    open_library,
    relative_cell,
    rows_of,
    solved_in,
)
from slap_ros.studies.study import PreparedStudy, format_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HELD, HEIGHT = "held", "z"  # features of what can be grasped
COLUMNS = (
    "approach",
    "tasks × libraries",
    "success [95 %]",
    "out of steps",
    "plan length [steps]",
    "± over libraries",
    "relative [95 %]",
    "replans",
    "planning [s]",
)
TABLE = """\
Length is the mean over solved tasks, with the sample standard deviation over tasks, and over the
means of the libraries. Relative length is over that of pure planning, on tasks that both solved;
its 95 % interval is from a bootstrap over tasks. Success has Wilson's 95 % interval as if the
trials of several libraries were independent; since they share the tasks, it is rather too narrow.
Replans are the mean over all tasks. In a row with shortcuts, every library solves every task. No
library was chosen by its figures here. Rows that are the paper's are from its own simulator, whose
baseline has other lengths. Seconds of planning are per task; they depend on the machine that made
this page and on what else it did."""


@dataclass(frozen=True)
class PapersRow:
    """What the paper has for an approach.

    Args:
        approach: Name of the approach, as in results.
        success_rate: Share of tasks solved.
        plan_length: Mean plan length, steps; None where the paper's figure is not known here.
    """

    approach: str
    success_rate: float
    plan_length: float | None = None


@dataclass(frozen=True)
class RobustnessStudy:
    """One of the studies: what it measures, and what the paper found.

    Args:
        name: Name of the study.
        source: Table of the paper.
        title: Title of its page, before the domain's name.
        measured: Explanation of its numbers.
        papers: Rows of the paper.
        preset: Preset of the tasks; None for the domain's first.
        hides_top: Whether the highest thing that can be grasped is never detected.
    """

    name: str
    source: str
    title: str
    measured: str
    papers: tuple[PapersRow, ...]
    preset: str | None = None
    hides_top: bool = False


@dataclass(frozen=True, kw_only=True)
class RobustnessOptions:
    """Options that these studies share."""

    domain: DomainName
    libraries: Libraries = None
    tasks: Tasks = 10
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    preset: Preset = None
    samples: Samples = SAMPLES
    max_replans: Annotated[
        int, CommandOption("Maximum number of plans after the first.", least=0)
    ] = 20
    jobs: Jobs = 1
    output: Output = RESULTS


@dataclass(frozen=True)
class RobustnessRow:
    """A way to plan, over all tasks and all libraries."""

    figures: Row

    @property
    def replans(self) -> Spread:
        """The number of replans, over all tasks."""
        return ReplannedTrials(self.figures.trials).replans

    def as_json(self) -> dict[str, Any]:
        """Every figure and every trial, for the report's JSON."""
        return {**self.figures.as_json(), "replans": asdict(self.replans)}

    def as_cells(self) -> list[str]:
        """Row of the page's table."""
        row = self.figures
        libraries = row.length_over_libraries
        count = "" if row.approach == PURE_PLANNING.name else f" × {len(row.results)}"
        return [
            label(row.approach),
            f"{row.tasks}{count}",
            str(row.solved),
            str(row.at_step_limit),
            format_spread(row.length, 1),
            "-" if libraries is None else f"{libraries.sd:.1f}",
            relative_cell(row),
            format_spread(self.replans, 1),
            format_spread(row.planning_seconds, 1),
        ]


def prepare(
    made: RobustnessStudy,
    options: RobustnessOptions,
    tell: Tell,
    more: Sequence[PlannedWay] = (),
    settings: Data | None = None,
    given: Data | None = None,
) -> PreparedStudy:
    """Open the domain and every library.

    Args:
        made: Study to make.
        options: Options of the command.
        tell: Function that receives warnings about shortcuts that are left out.
        more: Further ways to plan, after those with the libraries of the options.
        settings: Further settings that the report names.
        given: Further options of the command.

    Returns:
        The study, ready to be made.

    Raises:
        InvalidParameterError: There is nothing to compare with pure planning.
    """
    domain = get_domain(options.domain, options.preset or made.preset)
    folders = options.libraries or shipped_libraries(options.domain)
    trained = [one for folder in folders if (one := open_library(folder, domain, tell))]
    if not trained:
        raise InvalidParameterError(
            f"there is nothing to compare with pure planning in {options.domain}: give a shortcut "
            "library with --library"
        )
    chosen = sampling(options.samples)
    ways = [PlannedWay.of(one, approaches(one.library, chosen)[-1]) for one in trained]
    own = {
        "preset": domain.preset,
        "tasks": options.tasks,
        "seeds": options.seeds,
        "first_seed": options.first_seed,
        "samples": options.samples,
        "max_replans": options.max_replans,
    }
    experiment = Experiment(domain, options.tasks, options.seeds, options.first_seed)
    return PreparedStudy(
        {**own, "libraries": described(trained), **(settings or {})},
        lambda runner: _study(
            made, experiment, (PURELY, *ways, *more), options.max_replans, runner
        ),
        {"library": options.libraries, **own, **(given or {})},
    )


def described(trained: Sequence[TrainedLibrary]) -> list[dict[str, Any]]:
    """What the report says of libraries: which they are, and the environment steps of learning."""
    return [
        {
            **describe_library(one.name, one.library),
            "learning_steps": one.library.record.get("environment_steps", {}).get("learning", 0),
        }
        for one in trained
    ]


def renamed_way(trained: TrainedLibrary, samples: int, name: str) -> PlannedWay:
    """Planning with a library, as an approach of another name.

    Args:
        trained: Library to plan with.
        samples: Number of times that a shortcut is tried out in the model.
        name: Name of the approach in results.

    Returns:
        The way to plan.
    """
    approach = approaches(trained.library, sampling(samples))[-1]
    return PlannedWay.of(trained, replace(approach, name=name))


def _study(
    made: RobustnessStudy,
    experiment: Experiment,
    ways: Sequence[PlannedWay],
    max_replans: int,
    runner: JobRunner,
) -> StudyReport:
    """Solve every task in every way.

    Args:
        made: Study to make.
        experiment: Tasks to solve.
        ways: Ways to plan, pure planning first.
        max_replans: Largest number of plans after the first.
        runner: Runner of the jobs.
    """
    trials = solved_in(ways, experiment, runner, solve_task, (made.hides_top, max_replans))
    rows = [RobustnessRow(row) for row in rows_of(experiment, trials)]
    return StudyReport(
        study=made.name,
        source=made.source,
        title=f"{made.title}: {experiment.domain.name}",
        measured=made.measured,
        table=MarkdownTable(COLUMNS, [*(row.as_cells() for row in rows), *_papers_cells(made)]),
        found={
            "rows": [row.as_json() for row in rows],
            "papers": [asdict(one) for one in made.papers],
        },
        draw=lambda figure: draw(figure, rows, made.papers),
        size=(7.4, 1.0 + 0.45 * len(rows)),
    )


def solve_task(
    setup: PlanningSetup, hides_top: bool, max_replans: int, seed: int, index: int
) -> Trial:
    """Plan for a task, execute the plan in the world, and plan again where that diverges.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        hides_top: Whether the highest thing that can be grasped is never detected.
        max_replans: Largest number of plans after the first.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it: solved only if the goal holds in the world.
    """
    domain = setup.make_domain()
    task = domain.task(seed, index)
    initial = task.initial_state
    space, world = domain.atom_space(initial), domain.make_world(initial)
    goal = space.mask(task.goal)
    perceiver = None
    if hides_top:
        quality = Quality(hidden=frozenset({highest(initial)}))
        rng = np.random.default_rng([seed, index])
        perceiver = NoisyPerceiver.of(domain, space, initial, quality, rng)
    planner = PartialPlanner(space, domain.atom_space, partial(setup.make_planner, domain))
    episode = Executor(
        domain, planner, world, space, goal, task.step_limit, max_replans, perceiver
    ).run()
    return _trial(seed, index, episode, space.abstract(world.state) & goal == goal)


def _trial(seed: int, index: int, episode: EpisodeResult, holds: bool) -> Trial:
    """The figures of an episode, at whose end the goal holds in the world or does not."""
    trial = Trial.of(seed, index, episode)
    if trial.success and not holds:
        return replace(trial, success=False, reason="solved, as far as was seen, and is not")
    return trial


def highest(state: State) -> str:
    """The name of the highest thing that can be grasped."""
    things = [obj for obj in state.objects if {HELD, HEIGHT} <= set(obj.type.column)]
    return max(things, key=lambda obj: float(state.get(obj, HEIGHT))).name


def _papers_cells(made: RobustnessStudy) -> list[list[str]]:
    """Rows of the table with the paper's figures."""
    pure = next((one.plan_length for one in made.papers if one.approach == PURE_PLANNING.name), 0.0)
    return [
        [
            f"{label(one.approach)} (the paper's)",
            "",
            f"{one.success_rate:.0%}",
            "",
            "-" if one.plan_length is None else f"{one.plan_length}",
            "",
            f"{one.plan_length / pure:.2f}" if one.plan_length and pure else "-",
            "",
            "",
        ]
        for one in made.papers
    ]


def draw(figure: Figure, rows: Sequence[RobustnessRow], papers: Sequence[PapersRow]) -> None:
    """Draw success, with its interval, beside plan length; the paper's success as a diamond.

    Args:
        figure: Figure to draw into.
        rows: Ways to plan, the first on top.
        papers: Rows of the paper.
    """
    success, length = figure.subplots(1, 2, sharey=True)
    theirs = {one.approach: one for one in papers}
    for place, row in enumerate(one.figures for one in rows):
        style = APPROACH_STYLES[row.approach]
        plot_interval(success, place, row.solved.interval, style.colour)
        success.plot([100 * row.solved.share], [place], style.marker, color=style.colour)
        if row.approach in theirs:
            rate = theirs[row.approach].success_rate
            success.plot([100 * rate], [place], "D", color="none", markeredgecolor="black")
        if row.length is not None:
            spread = [row.length.sd]
            length.errorbar(
                [row.length.mean], [place], xerr=spread, fmt=style.marker, color=style.colour
            )
    name_rows(success, [label(one.figures.approach) for one in rows])
    success.set_xlim(-3, 103)
    success.set_xlabel("success [%]; diamonds: the paper's")
    length.set_xlim(left=0)
    length.set_xlabel("length of solved tasks [steps]")


def summary(found: Data) -> str:
    """Success and length of every way to plan, in a few words."""
    rows = found["rows"]
    rates = " → ".join(f"{row['success_rate']:.0%}" for row in rows)
    steps = " → ".join(format_steps(row["plan_length"]) for row in rows)
    return f"success {rates}; {steps} steps"
