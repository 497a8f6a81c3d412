# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The main table: success and plan length with shortcuts that were trained several times.

Each library is evaluated on the same tasks. A row is the mean over libraries, none of which was
chosen by what it does here (SLAP Table 1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Samples
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.api.shortcut_choice import SAMPLES, choose_library, sampling
from slap_ros.core import Domain
from slap_ros.domains import get_domain, preset_names
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach, approaches, shooting
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.statistics import Interval, SuccessRate, ratio_interval
from slap_ros.evaluation.summary import Spread, format_spread, lengths_of_both
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shipped import shipped_libraries
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup, named_tasks, not_solved, solve_task
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.job_runner import Job, JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Libraries, Output, Seeds, Tasks
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Every task is planned and executed in the world. Length is the number of environment steps executed.
A task that equals an earlier one is left out. In a row with shortcuts, every library solves every
task. Each library was trained with another seed, and no library was chosen by its figures here.
Success has Wilson's 95 % interval as if the trials of several libraries were independent; since
they share the tasks, it is rather too narrow. Length is the mean over solved tasks, with the sample
standard deviation over tasks, and over the means of the libraries. Relative length is the sum of
lengths over that of pure planning, on tasks that both solved; its 95 % interval is from a bootstrap
over tasks. "Search without learning" tries random actions as often as SLAP tries its policies,
between the same pairs of abstract states. Libraries with the same pairs share it. "Out of steps" is
the number of tasks that ran out of steps, at the domain's step limit. Seconds of planning are per
task; they depend on the machine that made this page and on what else it did."""


@dataclass(frozen=True)
class TrainedLibrary:
    """A library and what it is called: that of its folder."""

    name: str
    library: ShortcutLibrary


@dataclass(frozen=True)
class PlannedWay:
    """A library, and how it is planned with.

    Args:
        library: Name of the library; empty for pure planning.
        digest: Digest of the library; empty for pure planning.
        approach: Way to plan.
    """

    library: str
    digest: str
    approach: Approach

    @classmethod
    def of(cls, trained: TrainedLibrary, approach: Approach) -> PlannedWay:
        """A way to plan with a library."""
        return cls(trained.name, trained.library.digest, approach)


PURELY = PlannedWay("", "", PURE_PLANNING)


@dataclass(frozen=True)
class LibraryTrials:
    """All tasks of a preset, with one library or without.

    Args:
        library: Name of the library; empty for pure planning.
        approach: Name of the way to plan.
        trials: Trials by seed and index.
    """

    library: str
    approach: str
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Row:
    """A way to plan, over all tasks of a preset and all libraries.

    Args:
        preset: Name of the domain's preset.
        approach: Name of the way to plan.
        tasks: Number of different tasks.
        results: Trials with each library.
        baseline: Trials of the same tasks with pure planning.
    """

    preset: str
    approach: str
    tasks: int
    results: tuple[LibraryTrials, ...]
    baseline: tuple[Trial, ...]

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        approach: str,
        trials: Mapping[str, tuple[Trial, ...]],
        baseline: tuple[Trial, ...],
    ) -> Row:
        """The row of an experiment.

        Args:
            experiment: Tasks that were solved.
            approach: Name of the way to solve them.
            trials: Trials by the name of the library, which is empty for pure planning.
            baseline: Trials of the same tasks with pure planning.
        """
        results = tuple(LibraryTrials(name, approach, found) for name, found in trials.items())
        return cls(experiment.domain.preset, approach, len(experiment), results, baseline)

    @property
    def trials(self) -> list[Trial]:
        """The trials of all libraries."""
        return [trial for result in self.results for trial in result.trials]

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks that were solved."""
        return ReplannedTrials(self.trials).solved

    @property
    def at_step_limit(self) -> int:
        """Trials given up at the step limit."""
        return sum(trial.at_step_limit for trial in self.trials)

    @property
    def length(self) -> Spread | None:
        """Plan length over solved tasks; None where none was solved."""
        return ReplannedTrials(self.trials).length

    @property
    def length_over_libraries(self) -> Spread | None:
        """Spread of the libraries' mean lengths; None with fewer than two libraries."""
        means = [
            fmean(lengths)
            for result in self.results
            if (lengths := [t.plan_length for t in result.trials if t.success])
        ]
        return Spread.of(means) if len(means) > 1 else None

    @property
    def relative(self) -> tuple[float, Interval | None] | None:
        """Relative length and its interval; None where there are no common tasks.

        A task's length is its mean over the libraries that solved it, as tasks are what is
        resampled.
        """
        own, other = [], []
        for i, pure in enumerate(self.baseline):
            solved = [r.trials[i].plan_length for r in self.results if r.trials[i].success]
            if solved and pure.success and pure.plan_length:
                own.append(fmean(solved))
                other.append(float(pure.plan_length))
        return (sum(own) / sum(other), ratio_interval(own, other)) if other else None

    @property
    def planning_seconds(self) -> Spread:
        """Seconds that planning took for a task."""
        return Spread.of([trial.planning_seconds for trial in self.trials])

    def as_json(self) -> dict[str, Any]:
        """Every figure and every trial, for the report's JSON."""
        relative = self.relative
        return {
            "preset": self.preset,
            "approach": self.approach,
            "tasks": self.tasks,
            "success_rate": self.solved.share,
            "success_interval": asdict(self.solved.interval),
            "at_step_limit": self.at_step_limit,
            "plan_length": asdict(self.length) if self.length else None,
            "plan_length_over_libraries": (
                asdict(self.length_over_libraries) if self.length_over_libraries else None
            ),
            "relative_length": relative[0] if relative else None,
            "relative_interval": asdict(relative[1]) if relative and relative[1] else None,
            "planning_seconds": asdict(self.planning_seconds),
            "libraries": [
                {
                    "library": result.library or None,
                    "relative_length": _relative(result.trials, self.baseline),
                    "trials": [trial.as_json() for trial in result.trials],
                }
                for result in self.results
            ],
        }


def study(
    experiments: Sequence[Experiment],
    libraries: Sequence[TrainedLibrary],
    sampling: Sampling,
    runner: JobRunner,
) -> StudyReport:
    """Evaluate every library under every preset.

    Args:
        experiments: Tasks of each preset.
        libraries: Libraries; each is evaluated under every preset.
        sampling: Settings of how shortcuts are tried out.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    rows: list[Row] = []
    for experiment in experiments:
        rows += _rows(experiment.without_repetitions(), libraries, sampling, runner)
    domain = experiments[0].domain
    return StudyReport(
        study="table1",
        source="SLAP Table 1",
        title=f"Success and plan length: {domain.name}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [cells(row) for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, rows),
        size=(7.0, 3.0),
    )


def _rows(
    experiment: Experiment,
    libraries: Sequence[TrainedLibrary],
    sampling: Sampling,
    runner: JobRunner,
) -> list[Row]:
    """The rows of one preset, pure planning first.

    Args:
        experiment: Tasks of the preset.
        libraries: Trained libraries.
        sampling: Settings of how shortcuts are tried out.
        runner: Runner of the jobs.
    """
    planned = [PURELY]
    searched: set[tuple[str, ...]] = set()
    for trained in libraries:
        search, *ways = _ways(trained.library, experiment.domain, sampling)
        if _signatures(search) not in searched:  # nothing else tells searches apart: once is enough
            searched.add(_signatures(search))
            ways = [search, *ways]
        planned += [PlannedWay.of(trained, way) for way in ways]
    return rows_of(experiment, solved_in(planned, experiment, runner))


def solved_in(
    ways: Sequence[PlannedWay],
    experiment: Experiment,
    runner: JobRunner,
    solve: Callable[..., Trial] = solve_task,
    conditions: tuple[Any, ...] = (),
) -> list[LibraryTrials]:
    """Solve every task in every way.

    Args:
        ways: Ways to plan.
        experiment: Tasks to solve.
        runner: Runner of the jobs.
        solve: Function that solves a task, of the setup, the conditions, a seed and an index.
        conditions: What else the function is called with.

    Returns:
        The trials of each way.
    """
    batches = [_jobs(way, experiment, conditions) for way in ways]
    preset = experiment.domain.preset
    found = runner.run(preset, solve, Trial.from_json, *batches, failure=not_solved)
    return [
        LibraryTrials(way.library, way.approach.name, tuple(found[name] for name in batch))
        for way, batch in zip(ways, batches, strict=True)
    ]


def _jobs(way: PlannedWay, experiment: Experiment, conditions: tuple[Any, ...]) -> dict[str, Job]:
    """The tasks of an experiment, for a way to plan."""
    setup = PlanningSetup(DomainChoice.of(experiment.domain), experiment.planner, way.approach)
    whose = " ".join(filter(None, (way.library, way.digest, way.approach.name)))
    return {
        f"{experiment.domain.preset}, {whose}: {name}": (setup, *conditions, *task)
        for name, task in named_tasks(experiment).items()
    }


def rows_of(experiment: Experiment, results: Sequence[LibraryTrials]) -> list[Row]:
    """A row per approach, in the order of their first trials.

    Args:
        experiment: Tasks that were solved.
        results: Trials with each library, pure planning among them.
    """
    by_approach: dict[str, list[LibraryTrials]] = {}
    for one in results:
        by_approach.setdefault(one.approach, []).append(one)
    baseline = by_approach[PURE_PLANNING.name][0].trials
    return [
        Row(experiment.domain.preset, name, len(experiment), tuple(each), baseline)
        for name, each in by_approach.items()
    ]


def _ways(library: ShortcutLibrary, domain: Domain, sampling: Sampling) -> tuple[Approach, ...]:
    """The ways to plan with a library, the one that learned nothing first."""
    return (shooting(library, domain, sampling), *approaches(library, sampling)[1:])


def _signatures(approach: Approach) -> tuple[str, ...]:
    """Between which abstract states it looks for shortcuts."""
    return tuple(shortcut.signature.name for shortcut in approach.shortcuts)


COLUMNS = (
    "preset",
    "tasks × libraries",
    "approach",
    "success [95 %]",
    "out of steps",
    "plan length [steps]",
    "± over libraries",
    "relative [95 %]",
    "planning [s]",
)


def cells(row: Row) -> list[str]:
    """A row of the page's table."""
    libraries = row.length_over_libraries
    count = len(row.results)
    return [
        f"`{row.preset}`",
        f"{row.tasks}" if row.approach == "pure_planning" else f"{row.tasks} × {count}",
        label(row.approach),
        str(row.solved),
        str(row.at_step_limit),
        format_spread(row.length, 1),
        "-" if libraries is None else f"{libraries.sd:.1f}",
        relative_cell(row),
        format_spread(row.planning_seconds, 2),
    ]


def relative_cell(row: Row) -> str:
    """Relative length with its interval."""
    if row.approach == "pure_planning":
        return "1"
    if row.relative is None:
        return "-"
    value, interval = row.relative
    return f"{value:.2f}" + (f" [{interval.low:.2f}, {interval.high:.2f}]" if interval else "")


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """A bar for each row's relative length, a dot for each library's."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        style = APPROACH_STYLES[row.approach]
        if row.relative is None:
            continue
        axes.bar(place, row.relative[0], color=style.colour, width=0.7)
        dots = [_relative(result.trials, row.baseline) for result in row.results]
        known = [dot for dot in dots if dot is not None]
        if len(known) > 1:
            axes.scatter([place] * len(known), known, color="white", edgecolors="black", s=18)
    names = [f"{label(row.approach)} {row.preset}".replace(" ", "\n") for row in rows]
    axes.set_xticks(range(len(rows)), names, fontsize=8)
    axes.set_ylabel("relative length; dots: libraries")
    axes.grid(visible=False, axis="x")


def _relative(trials: Sequence[Trial], baseline: Sequence[Trial]) -> float | None:
    own, other = lengths_of_both(trials, baseline)
    return sum(own) / sum(other) if other else None


def _summary(found: Data) -> str:
    parts = []
    for preset in dict.fromkeys(row["preset"] for row in found["rows"]):
        rows = {row["approach"]: row for row in found["rows"] if row["preset"] == preset}
        pure, one, every = (
            format_steps(rows[name]["plan_length"])
            for name in ("pure_planning", "slap_1_sample", "slap")
        )
        success = rows["slap"]["success_rate"]
        parts.append(f"`{preset}`: {success:.0%}; {pure} → {one} steps (1 sample), {every} (all)")
    return "; ".join(parts)


@dataclass(frozen=True, kw_only=True)
class Table1Options:
    """Options of this study."""

    domain: DomainName
    libraries: Libraries = None
    tasks: Tasks = 10
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    presets: Annotated[
        list[str] | None,
        CommandOption(
            "Preset of the domain. May be repeated. Default: all whose world is as the planner's "
            "model.",
            name="--preset",
        ),
    ] = None
    samples: Samples = SAMPLES
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: Table1Options, tell: Tell) -> PreparedStudy:
    """Open every preset and every library."""
    domain = options.domain
    chosen = under_presets(domain, options.presets)
    folders = options.libraries or shipped_libraries(domain)
    trained = [one for folder in folders if (one := open_library(folder, chosen[0], tell))]
    tasks, seeds, first_seed = options.tasks, options.seeds, options.first_seed
    own = {"tasks": tasks, "seeds": seeds, "first_seed": first_seed, "samples": options.samples}
    described = [describe_library(one.name, one.library) for one in trained]
    experiments = [Experiment(one, tasks, seeds, first_seed) for one in chosen]
    return PreparedStudy(
        {**own, "libraries": described},
        lambda runner: study(experiments, trained, sampling(options.samples), runner),
        {"library": options.libraries, "preset": options.presets, **own},
    )


def under_presets(domain: str, presets: Sequence[str] | None) -> list[Domain]:
    """A domain under each of some presets.

    Args:
        domain: Name of the domain.
        presets: Names of the presets; None for all but those whose world differs from the planner's
            model, which have studies of their own.
    """
    if presets is not None:
        return [get_domain(domain, preset) for preset in presets]
    every = [get_domain(domain, preset) for preset in preset_names(domain)]
    return [one for one in every if one.make_model is None]


def open_library(folder: Path, domain: Domain, tell: Tell) -> TrainedLibrary | None:
    """Open a library, and name it as people tell them apart: by the folder, and the seed.

    Args:
        folder: Folder of the library.
        domain: Domain that the library must fit.
        tell: Function that receives warnings about shortcuts that are left out.

    Returns:
        The library and its name; None where there is none.
    """
    library = choose_library(str(folder), domain, "lazy", tell)
    name = "/".join(folder.resolve().parts[-2:])
    return None if library is None else TrainedLibrary(name, library)


STUDY = Study(
    "table1",
    help="SLAP Table 1: success and plan length on fresh tasks, over several trained libraries.",
    example="slap study table1 obstacle_tower --preset fair",
    options=Table1Options,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 1",
            "success and plan length",
            SLAP_DOMAINS,
            {
                "obstacle2d": "100%; 25.9 → 17.6 steps",
                "obstacle_tower": "100%; 245.8 → 79.2 steps",
                "cluttered_drawer": "100%; 352.1 → 165.8 steps",
                "cleanup_table": "100%; 431.8 → 115.2 steps",
            },
        ),
    ),
)
