# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How shortcuts are learned: success and length against environment steps (SLAP Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.summary import Spread
from slap_ros.studies.comparison import format_spread, spread_of
from slap_ros.studies.figures import LINES
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.trainings import LearningCurve, TrainingFolder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROWS = 6  # of the table, per shortcut: the first time, the last, and some between
THOUSAND = 1000.0
MEASURED = """\
What training writes down while it learns a shortcut: the part of recent episodes that ended in
success, and the number of environment steps of those. Both are with the noise of exploration and
from the starts of training, so they are not what planning with the shortcut comes to. Stages of a
training follow one another along the axis, dotted lines part them. Several trainings (seeds) of
the same shortcut are averaged where they have numbers for the same step count; mean ± sample
standard deviation."""


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


def study(domain: str, folders: Sequence[TrainingFolder]) -> StudyReport:
    """The curves in the work folders of trainings.

    Raises:
        InvalidParameterError: A folder has none, damaged ones, or those of another domain.
    """
    for folder in folders:
        folder.require_domain(domain)
    curves = [curve for folder in folders for curve in folder.curves()]
    names = dict.fromkeys(curve.shortcut for curve in curves)
    learned = [_together([c for c in curves if c.shortcut == name]) for name in names]
    return StudyReport(
        study="dynamics",
        source="SLAP Fig. 4",
        title=f"Learning dynamics: {domain}",
        measured=MEASURED,
        table=MarkdownTable(
            ["shortcut", "environment steps", "success [%]", "length [steps]"],
            [row for one in learned for row in one.as_rows()],
        ),
        found={"shortcuts": [one.as_json() for one in learned]},
        draw=lambda figure: draw(figure, learned),
        size=(6.4, 4.2 + 0.2 * len(learned)),
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


def draw(figure: Figure, learned: Sequence[LearningDynamics]) -> None:
    """Draw success above, length below, one line per shortcut."""
    above, below = figure.subplots(2, 1, sharex=True)
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
    below.set_xlabel("environment steps [thousands]")
    figure.legend(loc="outside upper center")  # one below the other: names are long


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
