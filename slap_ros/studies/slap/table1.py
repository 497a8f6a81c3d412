# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The main table: success and plan length with shortcuts that were trained several times.

Each library is evaluated on the same tasks. A row is the mean over libraries, none of which was
chosen by what it does here (SLAP Table 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Samples
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.api.shortcut_choice import SAMPLES, sampling
from slap_ros.core import Domain
from slap_ros.domains import get_domain, preset_names
from slap_ros.evaluation.approaches import Approach, approaches, shooting
from slap_ros.evaluation.experiment import Experiment
from slap_ros.evaluation.summary import format_spread
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shipped import shipped_libraries
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Libraries, Output, Seeds, Tasks
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.library_rows import (
    PURELY,
    PlannedWay,
    Row,
    TrainedLibrary,
    open_library,
    relative_cell,
    relative_length,
    rows_of,
    solved_in,
)
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


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """A bar for each row's relative length, a dot for each library's."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        style = APPROACH_STYLES[row.approach]
        if row.relative is None:
            continue
        axes.bar(place, row.relative[0], color=style.colour, width=0.7)
        dots = [relative_length(result.trials, row.baseline) for result in row.results]
        known = [dot for dot in dots if dot is not None]
        if len(known) > 1:
            axes.scatter([place] * len(known), known, color="white", edgecolors="black", s=18)
    names = [f"{label(row.approach)} {row.preset}".replace(" ", "\n") for row in rows]
    axes.set_xticks(range(len(rows)), names, fontsize=8)
    axes.set_ylabel("relative length; dots: libraries")
    axes.grid(visible=False, axis="x")


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
