# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How shortcuts are learned: success and length against environment steps (SLAP Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.drawing.palette import PLAN
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.studies.comparison import Comparison, spread_of
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import LINES
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.library_plans import LibraryPlans, plan_with
from slap_ros.studies.slap.trainings import LearningCurve, TrainingFolder, described
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROWS = 6  # of the table, per shortcut: the first time, the last, and some between
THOUSAND = 1000.0
MEASURED = """\
The curves are what training records while it learns a shortcut: the share of recent episodes that
succeeded, and the number of environment steps of those. Both have the noise of exploration, and
episodes begin at the starts of training. So they are not the results of planning with the shortcut.
Stages of a training follow one another along the axis; dotted lines separate them. Several
trainings (seeds) of the same shortcut are averaged at step counts that they share: mean ± sample
standard deviation."""
PLANNED = """

Plan length is the length of executed plans on the same {tasks} tasks of evaluation. They use the
shortcuts of the library named below, as they were after so many environment steps of learning each.
Length is the mean ± sample standard deviation, and relative to pure planning. A shortcut counts as
used if it is in at least one of these plans and reaches its target there."""


@dataclass(frozen=True)
class AveragedPoint:
    """Success and length in trainings of one shortcut after so many environment steps."""

    steps: int
    success: Spread
    length: Spread | None  # None where no episode succeeded

    def as_json(self) -> dict[str, Any]:
        """Steps, and mean and deviation of success and length, without nesting."""
        length = asdict(self.length) if self.length else {"mean": None, "sd": None}
        return {
            "steps": self.steps,
            **{f"success_{key}": value for key, value in asdict(self.success).items()},
            **{f"length_{key}": value for key, value in length.items()},
        }


@dataclass(frozen=True)
class LearningDynamics:
    """How one shortcut was learned, in one training or several."""

    shortcut: str
    trainings: int
    moments: tuple[AveragedPoint, ...]
    stages: tuple[int, ...]  # where each but the first begins, in environment steps

    def as_json(self) -> dict[str, Any]:
        """The averaged curve, for the report's JSON."""
        return {
            "shortcut": self.shortcut,
            "trainings": self.trainings,
            "stages": list(self.stages),
            "moments": [moment.as_json() for moment in self.moments],
        }

    def as_rows(self) -> Iterator[list[str]]:
        """Rows of a table, at even distances."""
        last = len(self.moments) - 1
        for number in sorted({round(i * last / (ROWS - 1)) for i in range(ROWS)}):
            moment = self.moments[number]
            percent = Spread(100.0 * moment.success.mean, 100.0 * moment.success.sd)
            several = self.trainings > 1
            yield [
                self.shortcut,
                f"{moment.steps:,}",
                format_spread(percent, 0) if several else f"{percent.mean:.0f}",
                format_spread(moment.length, 1)
                if several or not moment.length
                else f"{moment.length.mean:.1f}",
            ]


@dataclass(frozen=True)
class PlansAfterSteps:
    """Plans with shortcuts as they were after so many environment steps of learning each."""

    steps: int
    plans: LibraryPlans

    def as_json(self) -> dict[str, Any]:
        """Steps, the summary and every trial, for the report's JSON."""
        return {"steps": self.steps, "used": list(self.plans.used), **self.plans.as_json()}

    def as_row(self) -> list[str]:
        """Row of a table."""
        there, *rest = self.plans.as_cells()
        return [f"{self.steps:,}", there, str(len(self.plans.used)), *rest]


def study(folders: Sequence[TrainingFolder], comparison: Comparison) -> StudyReport:
    """The curves in the work folders of trainings, and plans in the course of them.

    Args:
        folders: Work folders of trainings in one domain.
        comparison: Pure planning, and for plans SLAP with a library that one of the trainings made.

    Returns:
        The report.

    Raises:
        InvalidParameterError: A folder has no curves, damaged ones, or those of another domain; or
            no training has made a shortcut of the library.
        InvalidLibraryError: A snapshot is damaged.
    """
    domain = comparison.domain.name
    for folder in folders:
        folder.require_domain(domain)
    curves = [curve for folder in folders for curve in folder.curves()]
    names = dict.fromkeys(curve.shortcut for curve in curves)
    learned = [_together([c for c in curves if c.shortcut == name]) for name in names]
    planned = plan_while_learned(folders, comparison) if len(comparison.approaches) > 1 else []
    measured = MEASURED
    if planned:
        columns = ("environment steps", "shortcuts", "used", "plan length [steps]", "relative")
        table = MarkdownTable(columns, [one.as_row() for one in planned])
        measured += PLANNED.format(tasks=len(comparison.experiment))
        measured += f"\n\n{table.as_markdown()}"
    return StudyReport(
        study="dynamics",
        source="SLAP Fig. 4",
        title=f"Learning dynamics: {domain}",
        measured=measured,
        table=MarkdownTable(
            ["shortcut", "environment steps", "success [%]", "length [steps]"],
            [row for one in learned for row in one.as_rows()],
        ),
        found={
            "shortcuts": [one.as_json() for one in learned],
            **({"plans": [one.as_json() for one in planned]} if planned else {}),
        },
        draw=lambda figure: draw(figure, learned, planned),
        size=(6.4, (7.4 if planned else 4.2) + 0.2 * len(learned)),
    )


def plan_while_learned(
    folders: Sequence[TrainingFolder], comparison: Comparison
) -> list[PlansAfterSteps]:
    """Plan with the shortcuts of a library as they were while they were learned.

    Args:
        folders: Work folders of trainings, one of which has made the library.
        comparison: Pure planning, and SLAP with the library; the tasks.

    Returns:
        Plans without any shortcut, and then whenever one of them was kept.

    Raises:
        InvalidParameterError: No training has made a shortcut of the library.
        InvalidLibraryError: A snapshot is damaged.
    """
    courses = [_course(folders, shortcut) for shortcut in comparison.approaches[-1].shortcuts]
    found: list[PlansAfterSteps] = []
    for steps in sorted({0, *(steps for course in courses for steps, _ in course)}):
        ready = [[one for began, one in course if began <= steps] for course in courses]
        shortcuts = tuple(versions[-1] for versions in ready if versions)
        trials = plan_with(comparison, shortcuts, f"{steps} steps of learning")
        names = tuple(one.name for one in shortcuts)
        baseline = found[0].plans.trials if found else trials
        found.append(PlansAfterSteps(steps, LibraryPlans(names, trials, baseline)))
    return found


def _course(
    folders: Sequence[TrainingFolder], shortcut: Shortcut
) -> tuple[tuple[int, Shortcut], ...]:
    for folder in folders:
        course = folder.while_learned(shortcut)
        if course is not None and len(course) > 1:
            return course
    raise InvalidParameterError(
        f"{', '.join(str(folder.path) for folder in folders)}: no training that came to "
        f"{shortcut.name} as the library has it, with snapshots of it on the way: train the "
        "library again with this version and the command in its library.json, or give "
        "--shortcuts none for the curves alone"
    )


def _together(curves: Sequence[LearningCurve]) -> LearningDynamics:
    """Curves of one shortcut, at the step counts that all of them have."""
    by_steps = [{point.steps: point for point in curve.points} for curve in curves]
    moments = []
    for steps in sorted(set.intersection(*map(set, by_steps))):
        points = [one[steps] for one in by_steps]
        success = Spread.of([point.success for point in points])
        lengths = [point.length for point in points if point.length is not None]
        moments.append(AveragedPoint(steps, success, spread_of(lengths)))
    if not moments:
        raise InvalidParameterError(
            f"{curves[0].shortcut}: these trainings have no step count in common: they had "
            "other settings; give trainings that differ in their seeds alone"
        )
    return LearningDynamics(curves[0].shortcut, len(curves), tuple(moments), curves[0].stages)


def draw(
    figure: Figure, learned: Sequence[LearningDynamics], planned: Sequence[PlansAfterSteps] = ()
) -> None:
    """Draw success above, length below, one line per shortcut; below them plans.

    Args:
        figure: Figure to draw into.
        learned: Curves, one per line.
        planned: Plans in the order of their steps; may be none.
    """
    above, below, *rest = figure.subplots(4 if planned else 2, 1, sharex=True)
    for number, one in enumerate(learned):
        colour, dashes = LINES[number % len(LINES)], ("-", "--")[number // len(LINES) % 2]
        pen = {"color": colour, "linestyle": dashes}
        steps = [moment.steps / THOUSAND for moment in one.moments]
        percent = [
            Spread(100.0 * moment.success.mean, 100.0 * moment.success.sd) for moment in one.moments
        ]
        _plot(above, steps, percent, pen | {"label": one.shortcut})
        _plot(below, steps, [moment.length for moment in one.moments], pen)
        for begins in one.stages:
            for axes in (above, below):
                axes.axvline(begins / THOUSAND, color=colour, linestyle=":", linewidth=1)
    above.set_ylim(-3, 103)
    above.set_ylabel("success of recent\nepisodes [%]")
    below.set_ylim(bottom=0)
    below.set_xlim(left=0)
    below.set_ylabel("length of successful\nepisodes [steps]")
    if planned:
        _plot_plans(rest[0], rest[1], planned)
    (above, below, *rest)[-1].set_xlabel("environment steps [thousands]")
    figure.legend(loc="outside upper center")  # one below the other: names are long


def _plot_plans(length: Axes, used: Axes, planned: Sequence[PlansAfterSteps]) -> None:
    """Plan length, and how many shortcuts plans have."""
    steps = [one.steps / THOUSAND for one in planned]
    pen = {"color": PLAN, "marker": "o", "markersize": 3}
    _plot(length, steps, [one.plans.length for one in planned], pen)
    length.set_ylim(bottom=0)
    length.set_ylabel("plan length\n[steps]")
    used.plot(steps, [len(one.plans.used) for one in planned], drawstyle="steps-post", color=PLAN)
    used.set_yticks(range(1 + max(len(one.plans.shortcuts) for one in planned)))
    used.set_ylabel("shortcuts used")


def _plot(
    axes: Axes, steps: Sequence[float], spreads: Sequence[Spread | None], pen: dict[str, Any]
) -> None:
    """Means as a line, a standard deviation around them as a band; a gap where there is none."""
    nothing = float("nan")
    means = [nothing if spread is None else spread.mean for spread in spreads]
    deviations = [nothing if spread is None else spread.sd for spread in spreads]
    axes.plot(steps, means, linewidth=1.4, **pen)
    if any(deviation > 0.0 for deviation in deviations):
        low = [mean - sd for mean, sd in zip(means, deviations, strict=True)]
        high = [mean + sd for mean, sd in zip(means, deviations, strict=True)]
        axes.fill_between(steps, low, high, color=pen["color"], alpha=0.2, linewidth=0)


def _summary(found: Data) -> str:
    ends = [one["moments"][-1] for one in found["shortcuts"]]
    each = ", ".join(f"{end['success_mean']:.0%} in {end['length_mean']:.1f} steps" for end in ends)
    if "plans" not in found:
        return each
    first, last = (format_steps(found["plans"][i]["plan_length"]) for i in (0, -1))
    return f"{each}; plans of {first} → {last} steps"


@dataclass(frozen=True, kw_only=True)
class DynamicsOptions(ComparisonOptions):
    """Options of this study."""

    work: Annotated[
        list[Path],
        CommandOption(
            "Work folder of a `slap train`. May be repeated, one folder per seed.",
            metavar="FOLDER",
        ),
    ]


def prepare(options: DynamicsOptions, tell: Tell) -> PreparedStudy:
    """Open the trainings; a library is not needed for their curves."""
    folders = [TrainingFolder(folder) for folder in options.work]
    compared = ChosenComparison.of(options, tell, described(folders), needs_library=False)
    return compared.prepare(lambda it: study(folders, it), work=options.work)


STUDY = Study(
    "dynamics",
    help="SLAP Fig. 4: learning curves from work folders, and plans with what was learned so far.",
    example="slap study dynamics obstacle2d --work runs/models/obstacle2d-training",
    options=DynamicsOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Fig. 4",
            "success and length while shortcuts are learned",
            SLAP_DOMAINS,
            {"": "curves"},
        ),
    ),
)
