# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How pure planning and SLAP compare on a robot in MuJoCo, by what stands on the table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text
from slap_ros.studies.results import MarkdownTable
from slap_ros.studies.slap.camera import SEEN
from slap_ros.studies.slap.transfer import OTHER
from slap_ros.studies.study import format_steps

# Rows: the study, its domain, and the name of the physics in its data.
ROWS = {
    "towers": ("transfer", "obstacle_tower", OTHER),
    "drawers": ("transfer", "cluttered_drawer", OTHER),
    "tables": ("transfer", "cleanup_table", OTHER),
    "towers, seen by a camera": ("camera", "obstacle_tower", SEEN),
}


def mujoco_table(results: Path) -> MarkdownTable:
    """Tasks solved in MuJoCo and steps, without and with shortcuts, for the front page.

    Args:
        results: Folder of the studies' data.

    Raises:
        InvalidParameterError: There is no data for a row.
    """
    rows = [[_link(name, *where), *_compared(*where, results)] for name, where in ROWS.items()]
    return MarkdownTable(("", "solved", "steps"), rows)


def _link(name: str, study: str, domain: str, _: str) -> str:
    return f"[{name}](docs/results/{study}_{domain}.md)"


def _compared(study: str, domain: str, physics: str, results: Path) -> list[str]:
    path = results / f"{study}_{domain}.json"
    if not path.exists():
        raise InvalidParameterError(
            f"no data in {results}; make it with `slap study {study} {domain}`"
        )
    pure, *_, slap = parse_json(read_text(path))["found"][physics]
    steps = [format_steps(one["plan_length"]) for one in (pure, slap)]
    return [f"{_solved(pure)} → {_solved(slap)} of {len(slap['trials'])}", " → ".join(steps)]


def _solved(approach: Mapping[str, Any]) -> int:
    return sum(trial["success"] for trial in approach["trials"])
