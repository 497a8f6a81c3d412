# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which command makes which table or figure of the papers, and what comes of it.

``docs/reproducing.md`` has these tables; :mod:`slap_ros.studies.readme` writes them from the data.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.files import parse_json, read_text
from slap_ros.studies.lg_sail.planning_ablation import PLANS
from slap_ros.studies.registry import STUDIES, paper_figures
from slap_ros.studies.results import Data, MarkdownTable
from slap_ros.studies.study import PaperFigure

NOT_RUN, NOT_MEASURED = "not run", "not measured"
# Minutes of one core, as measured on the machine that made the published figures.
MINUTES: Mapping[str, int] = {
    "replanning_stow_hammer": 6,
    "replanning_peg_in_hole": 3,
}
TRAINING_MINUTES: Mapping[str, int] = {
    "obstacle2d": 3,
    "obstacle_tower": 104,
    "cluttered_drawer": 40,
    "cleanup_table": 20,
}


@dataclass(frozen=True)
class PublishedFigure:
    """Data of a study as it is published.

    Args:
        name: Name of its files, without their endings.
        data: Content of its JSON file.
    """

    name: str
    data: Data

    @property
    def link(self) -> str:
        """Link to the figure's page, from a page of the documentation."""
        return f"[{self.data['domain']}](results/{self.name}.md)"

    @property
    def command(self) -> str:
        """Command that makes the figure again."""
        return f"`{self.data['command']}`"

    @property
    def found(self) -> str:
        """Its main figures, in a few words."""
        study = STUDIES[self.data["study"]]
        return study.summary(self.data["found"]) if study.summary else "-"

    @property
    def trials(self) -> str:
        """Number of seeds × tasks, and of what else there are several."""
        data = self.data
        if "trainings" in data:
            number = data["trainings"]
            trained = len(number) if isinstance(number, list) else number
            seeds = f"{data['seeds']} × " if "seeds" in data else ""
            tasks = f", {seeds}{data['tasks']} tasks" if "tasks" in data else ""
            return f"{trained} training{'s' if trained != 1 else ''}{tasks}"
        if "candidates" in data:
            return f"{data['candidates']} candidates"
        if "starts" in data:
            return f"{data['starts']} starts"
        if "trials" in data:
            return f"{data['trials']} trials each"
        if "plans" in data:
            few = f" of {PLANS}" if data["plans"] < PLANS else ""
            return f"{data['plans']}{few} plans"
        counted = f"{data.get('seeds', 1)} × {data['tasks']}"
        if data["study"] == "replanning":
            return f"{counted}, {data['others']} × {data['tasks']} of other libraries"
        libraries = len(data.get("libraries", ())) or _libraries_of_skills(data)
        return f"{counted} × {libraries} trained" if libraries else counted

    @property
    def core_seconds(self) -> tuple[float | None, str]:
        """Time of one core, s, and what of it was measured; None where nothing was."""
        if "cpu_seconds" in self.data:
            return float(self.data["cpu_seconds"]), ""
        if self.name in MINUTES:
            return 60.0 * MINUTES[self.name], ""
        seconds = sum(_seconds(self.data["found"]))
        return seconds or None, f" of {STUDIES[self.data['study']].costs} alone"

    @property
    def core_hours(self) -> str:
        """Time of one core, as a table has it."""
        seconds, what = self.core_seconds
        return NOT_MEASURED if seconds is None else f"{seconds / 3600:.2f}{what}"


def _seconds(found: Any) -> Iterator[float]:
    """Seconds of planning in all trials, of learning in all trainings, of all plans of a model."""
    if isinstance(found, Mapping):
        for key, value in found.items():
            if key in ("planning_seconds", "cpu_seconds") and isinstance(value, float):
                yield value
            else:
                yield from _seconds(value)
    elif isinstance(found, list):
        for value in found:
            yield from _seconds(value)


def published(results: Path) -> dict[str, PublishedFigure]:
    """Every figure of a folder that a study makes, by name; benchmarks make others."""
    found = {path.stem: parse_json(read_text(path)) for path in sorted(results.glob("*.json"))}
    return {
        name: PublishedFigure(name, data)
        for name, data in found.items()
        if str(data.get("command", "")).startswith("slap study ")
    }


def paper_table(results: Path) -> MarkdownTable:
    """A row for each figure of a paper and domain, those without data as well."""
    known = published(results)
    columns = (
        "figure",
        "shows",
        "domain",
        "command",
        "ours",
        "the paper's",
        "seeds × tasks",
        "core-hours",
    )
    return MarkdownTable(
        columns,
        [row for study, figure in paper_figures() for row in _rows_of(study, figure, known)],
    )


def other_table(results: Path) -> MarkdownTable:
    """A row for each figure that no paper has."""
    of_papers = {study.name for study in STUDIES.values() if study.figures}
    rows = [
        [one.data["study"], one.link, one.command, one.trials, one.core_hours]
        for one in published(results).values()
        if one.data["study"] not in of_papers
    ]
    return MarkdownTable(("study", "domain", "command", "seeds × tasks", "core-hours"), rows)


def _rows_of(
    study: str, figure: PaperFigure, known: Mapping[str, PublishedFigure]
) -> Iterator[list[str]]:
    about = [figure.source, figure.shows]
    others = [
        one.data["domain"]
        for one in known.values()
        if one.data["study"] == study and one.data["domain"] not in figure.domains
    ]
    for domain in (*figure.domains, *others) or ("",):
        papers = figure.found.get(domain, figure.found.get("", ""))
        one = known.get(f"{study}_{domain}")
        if one is not None:
            rest = [one.link, one.command, one.found, papers, one.trials, one.core_hours]
        else:
            command = f"`slap study {study} {domain or 'DOMAIN'}`"
            reason = f"{NOT_RUN}: {figure.not_run}" if figure.not_run else NOT_RUN
            rest = [domain, command, reason, papers, "", ""]
        yield [*about, *rest]
        about = ["", ""]


def _libraries_of_skills(data: Data) -> int:
    """How many there are behind each goal of the study of task progress; 0 for other studies."""
    if data["study"] != "acquisition":
        return 0
    goals = data["found"]["goals"]
    return sum(len(one["libraries"]) for one in goals if one["goal"] == goals[0]["goal"])
