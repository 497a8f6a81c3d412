# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures with a named row for each thing that was measured, the first row on top."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from slap_ros.drawing.palette import MUTED
from slap_ros.evaluation.statistics import Interval
from slap_ros.studies.figures import LINES

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows, and put the first one on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def plot_interval(axes: Axes, place: float, interval: Interval, colour: str = MUTED) -> None:
    """Draw the interval of a share in percent.

    Args:
        axes: Axes to draw into.
        place: Row of the interval.
        interval: Interval of a share between 0 and 1.
        colour: Colour of the line.
    """
    ends = [100 * interval.low, 100 * interval.high]
    axes.plot(ends, [place, place], color=colour, linewidth=1)


def plot_each(axes: Axes, place: float, values: Sequence[float]) -> None:
    """Draw a stroke for each value of a row.

    Args:
        axes: Axes to draw into.
        place: Row of the values.
        values: Horizontal coordinates.
    """
    axes.plot(values, [place] * len(values), "|", color=LINES[0], markersize=9)


def plot_whole(axes: Axes, place: float, value: float) -> None:
    """Draw a dot for the value of a whole row.

    Args:
        axes: Axes to draw into.
        place: Row of the value.
        value: Horizontal coordinate.
    """
    axes.plot([value], [place], "o", color=LINES[0], markersize=5)
