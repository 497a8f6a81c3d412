# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success over environment steps while shortcuts and whole tasks are learned (SLAP Fig. 8).

The curves are those that records of trainings have; nothing is run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from math import ceil
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.baselines import describe_baseline, require_gymnasium
from slap_ros.api.command_options import CommandOption, DomainName, Jobs
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.baselines.trained_baseline import TrainedBaseline
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.success_curve import SUCCESS_CURVE, SuccessPoint, recorded_curve
from slap_ros.shortcuts.shipped import shipped_libraries
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.options import RESULTS, Libraries, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.learners import learner_of
from slap_ros.studies.slap.library_rows import TrainedLibrary, open_library
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study
from slap_ros.studies.trained_baselines import (
    BASELINES,
    baselines_in_runs,
    open_baselines,
    other_goal,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED = """\
The curves are those that trainings record: the share of recent episodes that succeeded, over the
environment steps of learning. Episodes have the noise of exploration. So this is neither how often
plans nor how often evaluated policies succeed.

A *shortcut* is learned from the states where it begins, and an episode succeeds where it reaches
its target. Each shortcut that a training kept has a row and a line, over its own steps. Steps of
exploration, which finds what is worth learning, come before and are counted apart, once for all
shortcuts of a training; of several attempts, the curve is that of the best one. A learner of the
*whole task* begins where tasks of its preset begin, and an episode succeeds where the goal is
reached. So compare what has the same preset and learns the same. Recent are the last 200 episodes
of a shortcut, and the last 100 of a whole task. *Half* is when half of them succeeded for the first
time. A record without a curve, as older versions made it, has the end alone, a cross in the
picture, or nothing. Where one policy learned all shortcuts, that is of some episodes after
learning."""
WHOLE_TASK = "whole task"
HALF = 0.5
NO_CURVE = "no curve recorded"
FIRST = 400  # environment steps from which on curves are drawn: episodes are few before
DASHES = ("-", "--", ":", "-.")  # of several trainings or shortcuts of one learner


@dataclass(frozen=True)
class RecordedTraining:
    """What the record of a training says of how success rose.

    Args:
        learner: Name of the learner, as in tables of approaches.
        learns: Name of the shortcut, or :data:`WHOLE_TASK`.
        preset: Preset of the tasks that it was trained on.
        name: Name of the training: that of its folder.
        steps: Environment steps of learning.
        exploring: Environment steps of exploration before, of all shortcuts; None of a whole task.
        curve: Success over environment steps; empty where none was recorded.
        end: Success at the end; None where none was recorded.
        trained: What is said of a baseline, for the command that makes it again.
    """

    learner: str
    learns: str
    preset: str
    name: str
    steps: int
    exploring: int | None
    curve: tuple[SuccessPoint, ...]
    end: float | None
    trained: Data = field(default_factory=dict)

    @classmethod
    def of_shortcut(cls, trained: TrainedLibrary, shortcut: Shortcut) -> RecordedTraining:
        """The training of a library's shortcut, from their records."""
        record, curve = trained.library.record, recorded_curve(shortcut.record)
        return cls(
            learner_of(record),
            shortcut.name,
            str(record["preset"]),
            trained.name,
            int(shortcut.record["environment_steps"]),
            int(record["environment_steps"]["exploring"]),
            curve,
            curve[-1].success if curve else float(shortcut.record["success"]),
        )

    @classmethod
    def of_baseline(cls, name: str, baseline: TrainedBaseline) -> RecordedTraining:
        """The training of a baseline, from its record.

        Args:
            name: Name of the baseline's folder.
            baseline: Baseline that was trained.
        """
        curve = recorded_curve(baseline.record)
        about = {k: v for k, v in describe_baseline(baseline).items() if k != SUCCESS_CURVE}
        return cls(
            baseline.name,
            WHOLE_TASK,
            baseline.preset,
            name,
            int(baseline.record["environment_steps"]),
            None,
            curve,
            curve[-1].success if curve else None,
            {"name": name, **about},
        )

    @property
    def panel(self) -> str:
        """What its line is drawn beside: all that learns the same in the same preset."""
        return f"{WHOLE_TASK if self.learns == WHOLE_TASK else 'shortcuts'}, {self.preset}"

    @property
    def half(self) -> int | None:
        """Environment steps after which half of the episodes first succeeded; None for never."""
        return next((one.steps for one in self.curve if one.success >= HALF), None)

    def as_json(self) -> dict[str, Any]:
        """All figures and the curve."""
        return {
            "learner": self.learner,
            "learns": self.learns,
            "preset": self.preset,
            "training": self.name,
            "steps": self.steps,
            "exploring": self.exploring,
            "success": self.end,
            "half": self.half,
            "curve": [list(point) for point in self.curve],
            "trained": [self.trained] if self.trained else [],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        end = "-" if self.end is None else f"{self.end:.0%}"
        half = "never" if self.half is None else f"{self.half:,}"
        measured = [end, half if self.curve else NO_CURVE]
        exploring = "" if self.exploring is None else f"{self.exploring:,}"
        named = [label(self.learner), self.learns, f"`{self.preset}`", f"`{self.name}`"]
        return [*named, exploring, f"{self.steps:,}", *measured]


COLUMNS = (
    "learner",
    "learns",
    "preset",
    "training",
    "exploration [steps]",
    "learning [steps]",
    "success at the end",
    "half [steps]",
)


def study(
    domain: str, libraries: Sequence[TrainedLibrary], baselines: Mapping[str, TrainedBaseline]
) -> StudyReport:
    """Put the curves of all trainings side by side.

    Args:
        domain: Name of the domain.
        libraries: Libraries of shortcuts.
        baselines: Trained baselines by the names of their folders.

    Returns:
        The report.
    """
    shortcuts = [(one, each) for one in libraries for each in one.library.shortcuts]
    rows = [RecordedTraining.of_shortcut(*one) for one in shortcuts]
    rows += [RecordedTraining.of_baseline(name, one) for name, one in baselines.items()]
    panels = {row.panel: [one for one in rows if one.panel == row.panel] for row in rows}
    return StudyReport(
        study="curves",
        source="SLAP Fig. 8",
        title=f"Learning curves: {domain}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [row.as_row() for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, panels),
        size=(7.4, 0.4 + 3.4 * ceil(len(panels) / 2)),
    )


def draw(figure: Figure, panels: Mapping[str, Sequence[RecordedTraining]]) -> None:
    """Draw a panel for all that learns the same in the same preset.

    Args:
        figure: Figure to draw into.
        panels: Trainings of each panel by its title, one at least.
    """
    columns = min(2, len(panels))
    lines = ceil(len(panels) / columns)
    axes = list(figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
    for one, (title, rows) in zip(axes, panels.items(), strict=False):
        _draw_panel(one, title, rows)
    axes[0].set_xlim(left=FIRST)  # of all
    for one in axes[len(panels) :]:
        one.remove()


def _draw_panel(axes: Axes, title: str, rows: Sequence[RecordedTraining]) -> None:
    """A line for each training whose record has a curve, else a cross for its end alone."""
    dashes: dict[str, Any] = {row.learner: cycle(DASHES) for row in rows}
    for row in rows:
        pen: dict[str, Any] = {"color": APPROACH_STYLES[row.learner].colour}
        if row.curve:
            success = [100.0 * point.success for point in row.curve]
            pen |= {"linestyle": next(dashes[row.learner]), "linewidth": 1.3}
            axes.plot([point.steps for point in row.curve], success, **pen)
        elif row.end is not None:
            axes.plot([row.steps], [100.0 * row.end], "x", **pen)
    for learner in dashes:
        known = any(row.curve for row in rows if row.learner == learner)
        text = label(learner) if known else f"{label(learner)}: {NO_CURVE}"
        axes.plot([], [], "-" if known else "x", c=APPROACH_STYLES[learner].colour, label=text)
    axes.set_xscale("log")
    axes.set_ylim(-3, 103)
    axes.set_xlabel("environment steps")
    axes.set_ylabel("success of recent episodes [%]")
    axes.label_outer()
    above: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "alignment": "left"}
    axes.legend(title=title, title_fontsize=8, fontsize=7, **above)


def _summary(found: Data) -> str:
    """The success of each learner in the end, mean over its trainings that recorded it."""
    rows = found["rows"]
    return "; ".join(
        _in_words([row for row in rows if (row["learner"], row["preset"]) == one])
        for one in dict.fromkeys((row["learner"], row["preset"]) for row in rows)
    )


def _in_words(rows: Sequence[Data]) -> str:
    """What came of the trainings of a learner under a preset."""
    who = f"`{rows[0]['preset']}`: {label(rows[0]['learner'])}"
    ends = [row for row in rows if row["success"] is not None]
    if not ends:
        return f"{who} {NO_CURVE}"
    success, steps = fmean(row["success"] for row in ends), fmean(row["steps"] for row in ends)
    return f"{who} {success:.0%} after {steps:,.0f} steps"


@dataclass(frozen=True, kw_only=True)
class CurvesOptions:
    """Options of this study."""

    domain: DomainName
    libraries: Libraries = None
    against: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder of a baseline that `slap baseline train` made. May be repeated. Default: all "
            f"of {BASELINES}/DOMAIN-*.",
            metavar="FOLDER",
        ),
    ] = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: CurvesOptions, tell: Tell) -> PreparedStudy:
    """Open every library and every baseline; one that cannot be used is left out, and said.

    Raises:
        InvalidParameterError: There is none at all, or Gymnasium is not installed.
    """
    require_gymnasium()
    domain = get_domain(options.domain)
    chosen = options.libraries or shipped_libraries(domain.name)
    libraries = [one for folder in chosen if (one := open_library(folder, domain, tell))]
    folders = options.against or baselines_in_runs(domain.name)
    baselines = open_baselines(folders, domain, other_goal, tell)
    if not any(one.library.shortcuts for one in libraries) and not baselines:
        raise InvalidParameterError(
            f"there is no training of {domain.name} to show: give --library, a folder that `slap "
            f"train {domain.name}` made, or --against, one of `slap baseline train`"
        )
    described = [describe_library(one.name, one.library) for one in libraries]
    acting = [
        {"name": name, "digest": one.digest, "method": one.method, "preset": one.preset}
        for name, one in baselines.items()
    ]
    return PreparedStudy(
        {
            "trainings": len(libraries) + len(baselines),
            **({"libraries": described} if described else {}),
            **({"baselines": acting} if acting else {}),
        },
        lambda _: study(domain.name, libraries, baselines),
        {"library": options.libraries, "against": folders, "trainings": None},
    )


STUDY = Study(
    "curves",
    help="SLAP Fig. 8: success over environment steps of all that learns, from their records.",
    example="slap study curves obstacle2d --against runs/baselines/obstacle2d-ppo",
    options=CurvesOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Fig. 8",
            "success while other algorithms learn shortcuts",
            ("cleanup_table",),
            {"": "curves"},
        ),
    ),
)
