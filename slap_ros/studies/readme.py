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
from slap_ros.policies.shipped_models import shipped_with_siblings
from slap_ros.skills.skill_library import read_library_record
from slap_ros.studies.figures import label
from slap_ros.studies.growth_table import growth_table
from slap_ros.studies.mujoco_table import mujoco_table
from slap_ros.studies.reproducing import NOT_MEASURED, other_table, paper_table
from slap_ros.studies.results import MarkdownTable

PLACE = re.compile(r"(<!-- (\w+): slap study readme -->\n).*?(<!-- end -->)", re.DOTALL)
DOMAINS = {
    "obstacle2d": "Obstacle 2D",
    "obstacle_tower": "Obstacle Tower",
    "cluttered_drawer": "Cluttered Drawer",
    "cleanup_table": "Cleanup Table",
}
# SLAP Table 1, steps. There, a shortcut is rolled out once.
THE_PAPERS = {
    "obstacle2d": {"pure_planning": "25.9 ± 1.7", "slap_1_sample": "17.6 ± 1.5"},
    "obstacle_tower": {"pure_planning": "245.8 ± 10.4", "slap_1_sample": "79.2 ± 3.2"},
    "cluttered_drawer": {"pure_planning": "352.1 ± 49.5", "slap_1_sample": "165.8 ± 43.6"},
    "cleanup_table": {"pure_planning": "431.8 ± 33.1", "slap_1_sample": "115.2 ± 12.3"},
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

    Seconds of planning are left to the studies' own pages: they depend on what else a machine did.

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
            "out of steps",
            "plan length [steps]",
            "± over libraries",
            "relative",
            "the paper's [steps]",
        ),
        rows,
    )


def front_table(results: Path) -> MarkdownTable:
    """One row per domain of ``slap study table1``, under the preset ``fair``.

    Rivals were measured in all domains under the preset ``paper`` alone.

    Raises:
        InvalidParameterError: There is no data for a domain.
    """
    return MarkdownTable(
        (
            "",
            "pure planning [steps]",
            "SLAP [steps]",
            "relative [95 %]",
            "the paper's [steps]",
            "best rival, under `paper`",
        ),
        [
            [name, *_compared(key, results), _best_rival(key, results)]
            for key, name in DOMAINS.items()
        ],
    )


def _compared(domain: str, results: Path) -> list[str]:
    fair = _under("fair", domain, results)
    if not {"pure_planning", "slap"} <= fair.keys():
        raise InvalidParameterError(
            f"no data in {results}; make it with `slap study table1 {domain}`"
        )
    pure, slap = fair["pure_planning"], fair["slap"]
    papers = THE_PAPERS[domain]
    mean = {approach: length.split(" ")[0] for approach, length in papers.items()}
    return [
        f"{pure['plan_length']['mean']:.1f}",
        f"{slap['plan_length']['mean']:.1f}",
        _with_interval(slap["relative_length"], slap["relative_interval"]),
        f"{mean['pure_planning']} → {mean['slap_1_sample']}",
    ]


def _best_rival(domain: str, results: Path) -> str:
    """The learner of whole tasks that solves most, then in the fewest steps."""
    rows = [row for row in _rows_of("rivals", domain, results) if row["preset"] == "paper"]
    rivals = [row for row in rows if row["approach"] != "pure_planning"]
    if not rivals:
        return NOT_MEASURED
    solving = [row for row in rivals if row["success_rate"] > 0.0]
    if not solving:
        return "0% by all"
    best = min(solving, key=lambda row: (-row["success_rate"], row["plan_length"]["mean"]))
    solved, steps = best["success_rate"], best["plan_length"]["mean"]
    return f"{label(best['approach'])}: {solved:.0%}, {steps:.1f} steps"


def front_skill_table(results: Path) -> MarkdownTable:
    """Task progress by goal of ``slap study acquisition``, and the paper's, a row per domain."""
    data = _data_of("acquisition", results)
    return MarkdownTable(
        ("", "task progress, by goal", "LG-SAIL's"),
        [[f"`{one['domain']}`", *_of_skills(one)[2:4]] for one in data],
    )


def preset_table(results: Path) -> MarkdownTable:
    """How plans with all samples compare with pure planning under the preset ``paper``."""
    return MarkdownTable(
        ("", "relative length, all samples", "libraries", "tasks"),
        [[name, *_under_paper(key, results)] for key, name in DOMAINS.items()],
    )


def _under_paper(domain: str, results: Path) -> list[str]:
    row = _under("paper", domain, results).get("slap")
    if row is None:
        return [NOT_MEASURED, "", ""]
    length = _with_interval(row["relative_length"], None)
    return [length, f"{len(row['libraries'])}", f"{row['tasks']}"]


def _under(preset: str, domain: str, results: Path) -> dict[str, dict[str, Any]]:
    """Rows of ``slap study table1`` under a preset, by approach."""
    rows = _rows_of("table1", domain, results)
    return {row["approach"]: row for row in rows if row["preset"] == preset}


def _rows_of(study: str, domain: str, results: Path) -> list[dict[str, Any]]:
    """All rows of a study for a domain; none where there is no data."""
    path = results / f"{study}_{domain}.json"
    return list(parse_json(read_text(path))["found"]["rows"]) if path.exists() else []


def skill_table(results: Path) -> MarkdownTable:
    """Task progress of ``slap study acquisition``, with hand-written operators and rewards.

    Raises:
        InvalidLibraryError: A library that ships cannot be read.
    """
    columns = (
        "skills of",
        "libraries",
        "task progress, by goal",
        "LG-SAIL's",
        "environment steps of a training",
    )
    data = _data_of("acquisition", results)
    return MarkdownTable(columns, [_of_skills(one) for one in data])


def _data_of(study: str, results: Path) -> list[dict[str, Any]]:
    """The data of a study, of each domain; another study's name may begin with its name."""
    found = (parse_json(read_text(path)) for path in sorted(results.glob(f"{study}_*.json")))
    return [one for one in found if one["study"] == study]


def _of_skills(data: Mapping[str, Any]) -> list[str]:
    goals = [one for one in data["found"]["goals"] if one.get("rewarder", "manual") == "manual"]
    libraries = {one["library"] for goal in goals for one in goal["libraries"]}
    preset = "" if data["preset"] == "fair" else f" --preset {data['preset']}"
    trainings = _trainings(data["domain"])
    steps = sorted(one["steps"] for one in trainings)
    return [
        f"`slap acquire {data['domain']}{preset}{_changes(trainings[0])}`",
        f"{len(libraries)}",
        _by_goal({one["goal"]: one["progress"]["mean"] for one in goals}),
        _by_goal({one["goal"]: one["paper"] for one in goals if one["paper"] is not None}),
        " to ".join(f"{each:,}" for each in dict.fromkeys((steps[0], steps[-1]))),
    ]


def replanning_table(results: Path) -> MarkdownTable:
    """Every row of ``slap study replanning``, of all domains for which there is one."""
    data = _data_of("replanning", results)
    return MarkdownTable(
        (
            "domain",
            "goal",
            "trained with",
            "tasks",
            "success",
            "planned again",
            "replans per task",
            "failures",
        ),
        [[_page_of(one), *cells] for one in data for cells in map(_of_replanning, _goals(one))],
    )


def _goals(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    return list(data["found"]["goals"])


def _page_of(data: Mapping[str, Any]) -> str:
    return f"[{data['domain']}](results/{data['study']}_{data['domain']}.md)"


def _of_replanning(row: Mapping[str, Any]) -> list[str]:
    within = row["success_interval"]
    seeds = ", ".join(f"{library['seed']}" for library in row["libraries"])
    return [
        f"`{row['goal']}`" if row["goal"] else "the task's own",
        f"seed{'s' if len(row['libraries']) > 1 else ''} {seeds}",
        f"{row['tasks']}",
        f"{row['success_rate']:.0%} [{within['low']:.0%}, {within['high']:.0%}]",
        f"{row['replanned']}",
        f"{row['replans']['mean']:.2f}",
        ", ".join(f"`{name}` {count}" for name, count in row["failures"].items()) or "none",
    ]


def _by_goal(progress: Mapping[str, float]) -> str:
    return ", ".join(f"`{goal}` {share:.2f}" for goal, share in progress.items())


def _changes(training: Mapping[str, Any]) -> str:
    """Settings that a training's command changes, as its last options."""
    _, option, changes = str(training["command"]).partition(" --set ")
    return option + changes


def _trainings(domain: str) -> list[dict[str, Any]]:
    """Records of the libraries of skills that ship, with hand-written rewards."""
    records = map(read_library_record, shipped_with_siblings("skills", domain))
    return [one for one in records if one["rewarder"] == "manual"]


def _rows(domain: str, results: Path) -> Iterator[list[str]]:
    shown_domain, shown_preset = "", ""
    for row in _rows_of("table1", domain, results):
        name = DOMAINS[domain]
        preset = f"`{row['preset']}`"
        yield [
            name if name != shown_domain else "",
            preset if preset != shown_preset else "",
            *_figures(row),
            THE_PAPERS[domain].get(row["approach"], "") if row["preset"] == "paper" else "",
        ]
        shown_domain, shown_preset = name, preset


def _figures(row: Mapping[str, Any]) -> Iterator[str]:
    pure = row["approach"] == "pure_planning"
    yield f"{row['tasks']}" if pure else f"{row['tasks']} × {len(row['libraries'])}"
    yield label(row["approach"])
    within = row["success_interval"]
    yield f"{row['success_rate']:.0%} [{within['low']:.0%}, {within['high']:.0%}]"
    yield f"{row['at_step_limit']}"
    length = row["plan_length"]
    yield "-" if length is None else f"{length['mean']:.1f} ± {length['sd']:.1f}"
    over = row["plan_length_over_libraries"]
    yield "" if over is None else f"{over['sd']:.1f}"
    yield "1" if pure else _with_interval(row["relative_length"], row["relative_interval"])


def _with_interval(value: float | None, interval: Mapping[str, float] | None) -> str:
    if value is None:
        return "-"
    within = f" [{interval['low']:.2f}, {interval['high']:.2f}]" if interval else ""
    return f"{value:.2f}{within}"


TABLES: Mapping[str, Callable[[Path], MarkdownTable]] = {
    "slap": front_table,
    "mujoco": mujoco_table,
    "lg_sail": front_skill_table,
    "table1": main_table,
    "presets": preset_table,
    "skills": skill_table,
    "replanning": replanning_table,
    "growth": growth_table,
    "papers": paper_table,
    "others": other_table,
}
