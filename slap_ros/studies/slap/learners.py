# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans with shortcuts of other learners: other algorithms, or one policy for all.

SLAP Table 3 and Fig. 6. A library's record says how it was learned. Libraries of the same learner
share a row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from slap_ros.api.command_options import DomainName, Jobs, Preset, Samples
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.api.shortcut_choice import SAMPLES, sampling
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import approaches
from slap_ros.evaluation.experiment import Experiment
from slap_ros.evaluation.summary import format_spread
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shipped import shipped_libraries
from slap_ros.shortcuts.shortcut_library import Record, ShortcutLibrary
from slap_ros.studies.figures import LINES, label
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Libraries, Output, Seeds, Tasks
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each
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
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Every task is planned and executed in the world, with the shortcuts of each library. Libraries of
the same learner share a row: a policy for each shortcut by PPO (ours) or by SAC, or one policy for
all (Abstract Subgoals), and the same by SAC with relabelled steps (Abstract HER). Success has
Wilson's 95 % interval. Length is the mean over solved tasks with the sample standard deviation.
Relative length is over tasks that pure planning solved too. Shortcuts are those that a training
kept, and steps the environment steps in which they were learned, both as means over libraries."""


def learner_of(record: Record) -> str:
    """The learner of a library, as rows are called.

    Args:
        record: Record of how the library was made.
    """
    settings: Mapping[str, Any] = record.get("settings", {})
    sac = settings.get("sac")
    if settings.get("together", 1) > 1:
        if sac is None:
            return "subgoals"
        return "abstract_her" if sac["hindsight"] else "subgoals_sac"
    return "independent_ppo" if sac is None else "independent_sac"


def study(
    experiment: Experiment,
    libraries: Sequence[TrainedLibrary],
    chosen: Sampling,
    runner: JobRunner,
) -> StudyReport:
    """Plan with every library, and put those of the same learner together.

    Args:
        experiment: Tasks to solve.
        libraries: Libraries to plan with.
        chosen: Settings of how shortcuts are tried out.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    experiment = experiment.without_repetitions()
    ways = [PlannedWay.of(one, approaches(one.library, chosen)[-1]) for one in libraries]
    pure, *own = solved_in([PURELY, *ways], experiment, runner)
    learners = [learner_of(one.library.record) for one in libraries]
    of_learners = [replace(one, approach=name) for name, one in zip(learners, own, strict=True)]
    rows = rows_of(experiment, [pure, *of_learners])
    costs = [_costs([one.library for one in libraries], row.approach) for row in rows]
    return StudyReport(
        study="learners",
        source="SLAP Table 3, Fig. 6",
        title=f"Other learners of shortcuts: {experiment.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [_cells(*one) for one in zip(rows, costs, strict=True)]),
        found={"rows": [{**row.as_json(), **cost} for row, cost in zip(rows, costs, strict=True)]},
        draw=lambda figure: _draw(figure, rows),
        size=(7.0, 0.6 + 0.4 * len(rows)),
    )


def _costs(libraries: Sequence[ShortcutLibrary], learner: str) -> Data:
    """What the libraries of a learner have, and took; nothing of pure planning."""
    own = [one for one in libraries if learner_of(one.record) == learner]
    if not own:
        return {}
    steps = [one.record.get("environment_steps", {}).get("learning", 0) for one in own]
    return {
        "kept": [len(one.shortcuts) for one in own],
        "learning_steps": steps,
    }


COLUMNS = (
    "learner",
    "tasks × libraries",
    "success [95 %]",
    "plan length [steps]",
    "relative [95 %]",
    "shortcuts kept",
    "learning of these [steps]",
)


def _cells(row: Row, cost: Data) -> list[str]:
    """A row of the page's table."""
    count = len(row.results)
    return [
        label(row.approach),
        f"{row.tasks} × {count}" if cost else f"{row.tasks}",
        str(row.solved),
        format_spread(row.length, 1),
        relative_cell(row),
        f"{sum(cost['kept']) / count:.1f}" if cost else "-",
        f"{sum(cost['learning_steps']) / count:,.0f}" if cost else "-",
    ]


def _draw(figure: Figure, rows: Sequence[Row]) -> None:
    """A dot for each row's mean length, a stroke for each of its tasks."""
    axes = figure.subplots()
    name_rows(axes, [label(row.approach) for row in rows])
    for place, row in enumerate(rows):
        plot_each(axes, place, [float(t.plan_length) for t in row.trials if t.success])
        if row.length is not None:
            axes.plot([row.length.mean], [place], "o", color=LINES[1], markersize=6)
    axes.set_xlabel("plan length [steps]; strokes: tasks, dots: means")


def _summary(found: Data) -> str:
    return "; ".join(
        f"{label(row['approach'])} {row['success_rate']:.0%}, "
        f"{format_steps(row['plan_length'])} steps"
        for row in found["rows"]
    )


@dataclass(frozen=True, kw_only=True)
class LearnersOptions:
    """Options of this study."""

    domain: DomainName
    libraries: Libraries = None
    preset: Preset = None
    tasks: Tasks = 4
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    samples: Samples = SAMPLES
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: LearnersOptions, tell: Tell) -> PreparedStudy:
    """Open every library.

    Raises:
        InvalidParameterError: There is none to compare.
    """
    domain = get_domain(options.domain, options.preset)
    folders = options.libraries or shipped_libraries(options.domain)
    trained = [one for folder in folders if (one := open_library(folder, domain, tell))]
    if not trained:
        raise InvalidParameterError(
            f"no library of {domain.name} to compare: give --library, a folder that `slap train "
            f"{domain.name} --settings subgoals` made"
        )
    own = {"tasks": options.tasks, "seeds": options.seeds, "first_seed": options.first_seed}
    own["samples"] = options.samples
    experiment = Experiment(domain, options.tasks, options.seeds, options.first_seed)
    described = [
        {**describe_library(one.name, one.library), "learner": learner_of(one.library.record)}
        for one in trained
    ]
    return PreparedStudy(
        {"preset": domain.preset, **own, "libraries": described},
        lambda runner: study(experiment, trained, sampling(options.samples), runner),
        {"library": options.libraries, "preset": domain.preset, **own},
    )


STUDY = Study(
    "learners",
    help="SLAP Table 3, Fig. 6: plans with shortcuts of other learners, and of one policy for all.",
    example="slap study learners obstacle2d --library runs/models/subgoals",
    options=LearnersOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 3",
            "other algorithms that learn shortcuts",
            ("cleanup_table",),
            {"cleanup_table": "PPO 113.7, SAC 160.2, SAC+HER 131.0 steps; pure planning 446"},
        ),
        PaperFigure(
            "SLAP Fig. 6",
            "independent policies against one for all",
            SLAP_DOMAINS,
            {"": "independent policies are better"},
        ),
    ),
)
