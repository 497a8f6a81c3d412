# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How studies draw. matplotlib is needed for that alone, and loaded here alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from io import StringIO
from typing import TYPE_CHECKING, Any

from slap_ros.drawing.palette import BORDER, INK, MUTED, PLAN, SHORTCUT
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.summary import Spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Size = tuple[float, float]  # inches, width and height

STYLE: dict[Any, Any] = {
    "svg.hashsalt": "slap_ros",  # names inside depend on the drawing alone
    "svg.fonttype": "none",  # text stays text
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # one of the widest, so that others fit as well
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": BORDER,
    "axes.labelcolor": INK,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#e6e8eb",
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "legend.frameon": False,
    "figure.constrained_layout.wspace": 0.05,
}
APART = 0.1  # between markers of neighbouring series, in the unit of their places
# Okabe and Ito's, without yellow and black: apart from one another for the colour-blind as well.
LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")


@dataclass(frozen=True)
class ApproachStyle:
    """How an approach is drawn: approaches differ in colour and in shape."""

    label: str
    colour: str
    marker: str


APPROACH_STYLES = {
    "pure_planning": ApproachStyle("pure planning", PLAN, "o"),
    "slap_1_sample": ApproachStyle("SLAP, 1 sample", MUTED, "^"),
    "shooting": ApproachStyle("search without learning", "#e69f00", "D"),
    "slap": ApproachStyle("SLAP", SHORTCUT, "s"),
    "ppo": ApproachStyle("PPO", "#cc79a7", "P"),
    "sac_her": ApproachStyle("SAC+HER", "#56b4e9", "X"),
    "hierarchical": ApproachStyle("hierarchical RL", "#009e73", "d"),
    "sol": ApproachStyle("SOL", "#e69f00", "D"),
    "independent_ppo": ApproachStyle("PPO, a policy each", SHORTCUT, "s"),
    "independent_sac": ApproachStyle("SAC, a policy each", "#56b4e9", "X"),
    "subgoals": ApproachStyle("Abstract Subgoals (PPO)", "#cc79a7", "P"),
    "subgoals_sac": ApproachStyle("one policy, SAC", "#e69f00", "D"),
    "abstract_her": ApproachStyle("Abstract HER (SAC)", "#009e73", "d"),
    "slap_trained_perturbed": ApproachStyle("SLAP, trained perturbed", "#009e73", "v"),
}


def label(approach: str) -> str:
    """An approach as people read it."""
    return APPROACH_STYLES[approach].label


def require_matplotlib() -> None:
    """Refuse to begin what could not be drawn in the end.

    Raises:
        InvalidParameterError: matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise InvalidParameterError(
            "studies draw with matplotlib, which is not installed: pip install 'slap_ros[studies]'"
        )


def picture(draw: Callable[[Figure], None], size: Size) -> str:
    """SVG; the same drawing gives the same text."""
    from matplotlib import rc_context, rcdefaults, rcParams
    from matplotlib.figure import Figure

    with rc_context():
        rcdefaults()  # whatever the user's own settings are
        rcParams.update(STYLE)
        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        drawn = StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None, "Creator": None})
    # Editors strip spaces at the ends of lines: without them, the file stays the same.
    return "\n".join(line.rstrip() for line in drawn.getvalue().splitlines()) + "\n"


def plot_spreads(
    axes: Axes, places: Sequence[float], spreads: Sequence[Spread | None], approach: str
) -> None:
    """Draw means joined by a line, each with a bar of one standard deviation.

    Args:
        axes: Axes to draw into.
        places: Horizontal coordinates of the spreads.
        spreads: Spread at each place; None where there is nothing to draw.
        approach: Name of the approach, which gives colour and marker.
    """
    known = [(x, spread) for x, spread in zip(places, spreads, strict=True) if spread is not None]
    axes.errorbar(
        [x for x, _ in known],
        [spread.mean for _, spread in known],
        [spread.sd for _, spread in known],
        elinewidth=1,
        capsize=2.5,
        **_pen(approach),
    )


def plot_values(
    axes: Axes, places: Sequence[float], values: Sequence[float], approach: str
) -> None:
    """Draw values joined by a line.

    Args:
        axes: Axes to draw into.
        places: Horizontal coordinates of the values.
        values: Value at each place.
        approach: Name of the approach, which gives colour and marker.
    """
    axes.plot(places, values, **_pen(approach))


def plot_apart(
    axes: Axes,
    places: Sequence[float],
    values: Sequence[float],
    bars: tuple[Sequence[float], Sequence[float]],
    approach: str,
) -> None:
    """Draw values that are not joined, because their places have no order, each with a bar.

    Args:
        axes: Axes to draw into.
        places: Horizontal coordinates of the values.
        values: Value at each place; what is not a number is not drawn.
        bars: Length of each bar below and above its value.
        approach: Name of the approach, which gives colour and marker.
    """
    axes.errorbar(
        places, values, bars, linestyle="none", elinewidth=1, capsize=2.5, **_pen(approach)
    )


def _pen(approach: str) -> dict[str, Any]:
    mark = APPROACH_STYLES[approach]
    return {
        "color": mark.colour,
        "marker": mark.marker,
        "label": mark.label,
        "markersize": 5,
        "linewidth": 1.2,
    }


def legend_above(figure: Figure, axes: Axes) -> None:
    """One legend for the whole figure, with what is in these axes; each label once."""
    handles, labels = axes.get_legend_handles_labels()
    named = {label: handle for handle, label in zip(handles, labels, strict=True)}
    figure.legend(
        named.values(), named.keys(), loc="outside upper center", ncols=min(len(named), 3)
    )


def dodged(places: Sequence[float], number: int, count: int) -> list[float]:
    """Move the places of one of several series, so that markers do not cover each other.

    Args:
        places: Horizontal coordinates that the series share.
        number: Number of the series, from 0.
        count: Number of series.

    Returns:
        The places of that series.
    """
    return [place + (number - (count - 1) / 2) * APART for place in places]
