# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where shortcuts still help when tasks differ from those of training (SLAP Fig. 5).

The library stays as it is; a setting of the preset at a time takes other values.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.evaluation.summary import format_spread
from slap_ros.studies.comparison import ApproachResult, Comparison
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import dodged, label, legend_above, plot_spreads, plot_values
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.variations import Variation, offered, parse_variation
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

UNCHANGED = "unchanged"
MEASURED = """\
Pure planning and SLAP plan and execute the same tasks while one setting varies. All other settings
stay as in the preset; in the rows *unchanged*, every setting does. The library is always the same,
and nothing is trained again. Length is the number of environment steps executed, mean ± sample
standard deviation over solved tasks. Relative length is the mean over that of pure planning, on
tasks that both solved. A task for which no plan is found counts as failed."""


@dataclass(frozen=True)
class StudyCondition:
    """One value of one setting; neither of them where the preset is unchanged."""

    setting: str | None
    value: str | None
    preset: str
    measured: tuple[ApproachResult, ...]  # one per approach

    def as_json(self) -> dict[str, Any]:
        """The setting, its value and every trial, for the report's JSON."""
        return {
            "setting": self.setting,
            "value": self.value,
            "preset": self.preset,
            "approaches": [one.as_json() for one in self.measured],
        }

    def as_rows(self) -> Iterator[list[str]]:
        """Rows of a table, one per approach."""
        where = UNCHANGED if self.setting is None else f"{self.setting} {self.value}"
        for one in self.measured:
            summary = one.summary
            relative = summary.relative_length
            yield [
                where,
                label(summary.approach),
                f"{summary.success_rate:.0%}",
                format_spread(summary.plan_length, 1),
                "-" if relative is None else f"{relative:.2f}",
            ]


def study(comparison: Comparison, variations: Sequence[Variation]) -> StudyReport:
    """Measure under every value of every setting.

    Args:
        comparison: Approaches, and the tasks that they solve.
        variations: Settings and their values.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no such setting, or it cannot have that value.
    """
    base = comparison.domain.preset
    planned = [(None, None, comparison)] + [
        (one.setting, value, comparison.under(one.preset(base, value)))
        for one in variations
        for value in one.values
    ]
    conditions = [
        StudyCondition(setting, value, under.domain.preset, under.measure())
        for setting, value, under in planned
    ]
    return StudyReport(
        study="generalisation",
        source="SLAP Fig. 5",
        title=f"Generalisation: {comparison.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(
            ["setting", "approach", "success", "length [steps]", "relative length"],
            [row for condition in conditions for row in condition.as_rows()],
        ),
        found={"conditions": [condition.as_json() for condition in conditions]},
        draw=lambda figure: draw(figure, conditions, variations),
        size=(1.2 + 2.6 * len(variations), 3.8),
    )


def draw(
    figure: Figure, conditions: Sequence[StudyCondition], variations: Sequence[Variation]
) -> None:
    """Draw one column per setting: success above, length below.

    Args:
        figure: Figure to draw into.
        conditions: The unchanged preset, which is at the left of every column, then the others.
        variations: The settings, in the order of columns.
    """
    unchanged, *others = conditions
    grid = figure.subplots(
        2, len(variations), squeeze=False, sharex="col", sharey="row", height_ratios=(1, 2.4)
    )
    for column, variation in zip(grid.T, variations, strict=True):
        varied = [one for one in others if one.setting == variation.setting]
        _plot(column, [0], [unchanged])
        _plot(column, range(1, len(varied) + 1), varied)
        for axes in column:
            axes.axvspan(-0.5, 0.5, color="#f1f3f5", zorder=0)
        ticks = ["as in\npreset", *(one.value or "" for one in varied)]
        column[1].set_xticks(range(len(ticks)), ticks)
        column[1].set_xlim(-0.5, len(varied) + 0.5)
        column[1].set_xlabel(variation.label)
    grid[0, 0].set_ylim(-8, 108)
    grid[0, 0].set_ylabel("success [%]")
    grid[1, 0].set_ylim(bottom=0)
    grid[1, 0].set_ylabel("length of solved\ntasks [steps]")
    legend_above(figure, grid[1, 0])


def _plot(
    column: Sequence[Axes], places: Sequence[int], conditions: Sequence[StudyCondition]
) -> None:
    """Success into the upper axes, length into the lower; approaches beside each other."""
    above, below = column
    count = len(conditions[0].measured)
    for number in range(count):
        summaries = [condition.measured[number].summary for condition in conditions]
        beside = dodged(places, number, count)
        name = summaries[0].approach
        plot_values(above, beside, [100.0 * one.success_rate for one in summaries], name)
        plot_spreads(below, beside, [one.plan_length for one in summaries], name)


def _summary(found: Data) -> str:
    slap = [one["approaches"][-1] for one in found["conditions"]]
    lengths = [one["relative_length"] for one in slap if one["relative_length"] is not None]
    least = min(one["success_rate"] for one in slap)
    success = f"success {least:.0%}" + (" or more" if least < 1.0 else "")
    return (
        f"relative length {min(lengths):.2f} to {max(lengths):.2f}, {success}, "
        f"in {len(slap)} conditions"
    )


@dataclass(frozen=True, kw_only=True)
class GeneralisationOptions(ComparisonOptions):
    """Options of this study."""

    vary: Annotated[
        list[str] | None,
        CommandOption(
            "Setting to vary and its values, as setting=value,value,... May be "
            "repeated. Default: the usual settings."
        ),
    ] = None


def prepare(options: GeneralisationOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library, and choose what varies."""
    compared = ChosenComparison.of(options, tell)
    given = [parse_variation(text) for text in options.vary or ()]
    variations = given or offered(compared.domain)
    return compared.ends().prepare(lambda it: study(it, variations), vary=options.vary)


STUDY = Study(
    "generalisation",
    help="SLAP Fig. 5: pure planning and SLAP as obstacles, distractors, mass or friction vary.",
    example="slap study generalisation obstacle_tower --vary obstacles=1,3,5",
    options=GeneralisationOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Fig. 5",
            "other obstacles, distractors, mass, friction",
            SLAP_DOMAINS,
            {"": "bars"},
        ),
    ),
)
