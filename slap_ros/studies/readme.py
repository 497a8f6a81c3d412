# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of README and documentation, written from the data of studies.

A table stands between two comments, the first of which names it:

    <!-- table1: slap study readme -->
    <!-- end -->
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text
from slap_ros.studies.figures import label
from slap_ros.studies.results import MarkdownTable

PLACE = re.compile(r"(<!-- (\w+): slap study readme -->\n).*?(<!-- end -->)", re.DOTALL)
DOMAINS = {
    "obstacle2d": "Obstacle 2D",
    "obstacle_tower": "Obstacle Tower",
    "cluttered_drawer": "Cluttered Drawer",
    "cleanup_table": "Cleanup Table",
}


def with_tables(text: str, results: Path) -> str:
    """A page with every table as the data has it.

    Args:
        text: The page, Markdown.
        results: Folder of the studies' data.

    Raises:
        InvalidParameterError: There is no table of a name, or no data for it.
    """

    def table(match: re.Match[str]) -> str:
        if match[2] not in TABLES:
            raise InvalidParameterError(
                f"there is no table {match[2]!r}; there are {', '.join(TABLES)}"
            )
        return f"{match[1]}\n{TABLES[match[2]](results).as_markdown()}\n\n{match[3]}"

    return PLACE.sub(table, text)


def main_table(results: Path) -> MarkdownTable:
    """Every row of ``slap study table1``, of all domains for which there is one.

    Raises:
        InvalidParameterError: There is none at all.
    """
    rows = [cells for domain in DOMAINS for cells in _rows(domain, results)]
    if not rows:
        raise InvalidParameterError(
            f"no data in {results}; make it with `slap study table1 DOMAIN`"
        )
    return MarkdownTable(
        (
            "",
            "preset",
            "tasks × libraries",
            "",
            "success",
            "at limit",
            "plan length [steps]",
            "± over libraries",
            "relative",
            "planning [s]",
        ),
        rows,
    )


def _rows(domain: str, results: Path) -> Iterator[list[str]]:
    path = results / f"table1_{domain}.json"
    if not path.exists():
        return
    shown_domain, shown_preset = "", ""
    for row in parse_json(read_text(path))["found"]["rows"]:
        name = DOMAINS[domain]
        preset = f"`{row['preset']}`"
        yield [
            name if name != shown_domain else "",
            preset if preset != shown_preset else "",
            *_figures(row),
        ]
        shown_domain, shown_preset = name, preset


def _figures(row: Mapping[str, Any]) -> Iterator[str]:
    pure = row["approach"] == "pure_planning"
    yield f"{row['tasks']}" if pure else f"{row['tasks']} × {len(row['libraries'])}"
    yield label(row["approach"])
    within = row["success_interval"]
    yield f"{row['success_rate']:.0%} [{within['low']:.0%}, {within['high']:.0%}]"
    yield f"{row['at_step_limit']}"
    yield _spread(row["plan_length"], 1)
    over = row["plan_length_over_libraries"]
    yield "" if over is None else f"{over['sd']:.1f}"
    yield "1" if pure else _with_interval(row["relative_length"], row["relative_interval"])
    yield _spread(row["planning_seconds"], 2)


def _spread(spread: Mapping[str, float] | None, digits: int) -> str:
    return "-" if spread is None else f"{spread['mean']:.{digits}f} ± {spread['sd']:.{digits}f}"


def _with_interval(value: float | None, interval: Mapping[str, float] | None) -> str:
    if value is None:
        return "-"
    within = f" [{interval['low']:.2f}, {interval['high']:.2f}]" if interval else ""
    return f"{value:.2f}{within}"


TABLES: Mapping[str, Callable[[Path], MarkdownTable]] = {"table1": main_table}
