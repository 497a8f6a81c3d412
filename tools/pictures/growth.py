# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the time until a first plan grows with the number of blocks, from its measured data."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from slap_ros.drawing.palette import INK, MUTED, PLAN
from slap_ros.studies.figures import picture
from tools.imports import ROOT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DATA = ROOT / "docs" / "images" / "growth.json"
SIZE = (5.0, 3.2)  # inches
TICKS_S = (0.06, 0.12, 0.25, 0.5, 1.0)


def make(path: Path) -> None:
    """Draw the data of ``python -m benchmarks.growth``.

    Args:
        path: Path of the picture.
    """
    data = json.loads(DATA.read_text(encoding="utf-8"))
    path.write_text(picture(lambda figure: _draw(figure, data), SIZE), encoding="utf-8")


def _draw(figure: Figure, data: dict[str, Any]) -> None:
    axes, rows = figure.add_subplot(), [row for row in data["rows"] if row["seconds"]]
    places = [row["blocks"] for row in rows]
    for row in rows:
        seconds = row["seconds"]
        axes.plot([row["blocks"]] * len(seconds), seconds, "o", color=MUTED, markersize=3)
    means = [fmean(row["seconds"]) for row in rows]
    axes.plot(places, means, "o-", color=PLAN, markersize=5, linewidth=1.2, label="mean")
    power = data["slope"]
    line = [means[0] * (n / places[0]) ** power for n in places]
    axes.plot(places, line, "--", color=INK, linewidth=0.8, label=f"power {power:.2f}")
    axes.set(xscale="log", yscale="log", xlabel="blocks", ylabel="s until the first plan")
    axes.set_xticks(places, labels=[str(n) for n in places])
    axes.set_yticks(TICKS_S, labels=[f"{tick:g}" for tick in TICKS_S])
    axes.minorticks_off()
    axes.legend()
