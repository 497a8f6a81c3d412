# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How plans with skills and shortcuts that grew compare with these skills alone, by seed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import mean_interval
from slap_ros.files import parse_json, read_text
from slap_ros.learning.grown_libraries import GrownLibraries
from slap_ros.policies.shipped_models import shipped_folder
from slap_ros.skills.skill_library import read_library_record
from slap_ros.studies.results import MarkdownTable

ALONE, ONE_SAMPLE, ALL_SAMPLES = "skills", "slap_1_sample", "slap"  # approaches of an evaluation
COLUMNS = (
    "seed",
    "solved by skills alone",
    "solved with shortcuts",
    "skills alone [steps]",
    "with shortcuts, one sample",
    "with shortcuts, 16 samples",
    "relative, one sample [95 %]",
    "relative, 16 samples [95 %]",
)


def growth_table(results: Path) -> MarkdownTable:
    """Every growth that ships, the one that saves least first, and the mean over seeds.

    Args:
        results: Folder of the studies' data, which these are not part of.

    Raises:
        InvalidParameterError: None ships.
    """
    del results
    folder = shipped_folder("grown")
    grown = sorted(folder.rglob("evaluation.json")) if folder is not None else []
    if not grown:
        raise InvalidParameterError("models/grown has no growth; make one with `slap grow DOMAIN`")
    rows = sorted(map(_growth, grown), key=lambda row: -row[ALL_SAMPLES]["relative_length"])
    return MarkdownTable(COLUMNS, [*map(list, map(_cells, rows)), list(_over_seeds(rows))])


def _growth(evaluation: Path) -> dict[str, Any]:
    """An evaluation's rows by approach, and the seed of the skills."""
    rows = {row["approach"]: row for row in parse_json(read_text(evaluation))["approaches"]}
    seed = read_library_record(GrownLibraries(evaluation.parent).skills)["seed"]
    return {"seed": seed, **rows}


def _cells(growth: Mapping[str, Any]) -> Iterator[str]:
    yield f"{growth['seed']}"
    alone, *with_shortcuts = [growth[name] for name in (ALONE, ONE_SAMPLE, ALL_SAMPLES)]
    yield _solved(alone)
    yield _solved(min(with_shortcuts, key=lambda row: float(row["success_rate"])))
    for row in (alone, *with_shortcuts):
        yield f"{row['plan_length']['mean']:.1f}"
    for row in with_shortcuts:
        within = row["relative_interval"]
        yield f"{row['relative_length']:.2f} [{within['low']:.2f}, {within['high']:.2f}]"


def _solved(row: Mapping[str, Any]) -> str:
    trials = int(row["tasks"]) * int(row["seeds"])
    return f"{round(row['success_rate'] * trials)} of {trials}"


def _over_seeds(growths: list[dict[str, Any]]) -> Iterator[str]:
    yield from ("mean over seeds", "", "")
    for name in (ALONE, ONE_SAMPLE, ALL_SAMPLES):
        yield f"{fmean(one[name]['plan_length']['mean'] for one in growths):.1f}"
    for name in (ONE_SAMPLE, ALL_SAMPLES):
        relative = [float(one[name]["relative_length"]) for one in growths]
        within = mean_interval(relative)
        known = f" [{within.low:.2f}, {within.high:.2f}]" if within is not None else ""
        yield f"{fmean(relative):.2f}{known}"
