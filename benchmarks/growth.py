# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First plans as blocks are added: ``python -m benchmarks.growth [--tasks N] [--output FILE]``.

The slope of the logarithms of time and number of blocks is the power with which time grows.
``python -m tools.pictures growth`` draws what the command wrote. Times are seconds of one core.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.full_tables import FIRST_SEED, plan, warm_up
from benchmarks.printing import show
from slap_ros.domains import get_domain

BLOCKS = (  # blocks, and the table on which so many stand
    (4, "fair:towers=1,obstacles=2,distractors=1"),
    (6, "fair:towers=2,obstacles=2,distractors=0"),
    (8, "fair:towers=2,obstacles=3,distractors=0"),
    (10, "fair:towers=2,obstacles=4,distractors=0"),
    (12, "fair:towers=3,obstacles=3,distractors=0"),
    (14, "fair:towers=2,obstacles=6,distractors=0"),
    (16, "fair:towers=3,obstacles=4,distractors=1"),
)


def first_plans(tasks: int) -> Iterator[dict[str, Any]]:
    """For each number of blocks, the seconds until the first plan of each task that has one.

    Args:
        tasks: Number of tasks for each table: the first of so many seeds.
    """
    warm_up()
    for blocks, preset in BLOCKS:
        domain = get_domain("obstacle_tower", preset)
        every = [plan(domain, domain.task(FIRST_SEED + i), "none") for i in range(tasks)]
        found = [one for one in every if one is not None]
        yield {
            "blocks": blocks,
            "preset": preset,
            "tasks": tasks,
            "seconds": [one.first_seconds for one in found],
            "steps": [one.first.steps for one in found],
        }


def slope(rows: list[dict[str, Any]]) -> float:
    """The power of the number of blocks with which the time of all tasks grows."""
    points = [(log(row["blocks"]), log(s)) for row in rows for s in row["seconds"]]
    blocks, seconds = np.transpose(points)
    return float(np.polyfit(blocks, seconds, 1)[0])


def main() -> None:
    """Print a row for each number of blocks, and write all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=5)
    parser.add_argument("--output", type=Path, help="JSON file for the picture")
    arguments = parser.parse_args()
    rows = []
    for row in first_plans(arguments.tasks):
        rows.append(row)
        mean = float(np.mean(row["seconds"])) if row["seconds"] else float("nan")
        show({f"{row['blocks']} blocks": {"s": mean, "solved": len(row["seconds"])}}, False)
    figures = {"slope": slope(rows), "rows": rows}
    show({"slope": figures["slope"]}, False)
    if arguments.output is not None:
        arguments.output.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
