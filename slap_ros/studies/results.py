# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study leaves behind: its data as JSON, a picture as SVG and a page as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slap_ros.api.command_line import command_line
from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, pretty_json, read_text, write_whole
from slap_ros.studies.figures import Size, picture
from slap_ros.versions import versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Data = Mapping[str, Any]  # numbers, text, lists and mappings of these, as JSON has them


@dataclass(frozen=True)
class MarkdownTable:
    """A table of a page; every row has one entry per column."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    def as_markdown(self) -> str:
        """The table as Markdown, without a line break at the end."""
        rule = ["---"] * len(self.columns)
        return "\n".join(_row(cells) for cells in (self.columns, rule, *self.rows))


@dataclass(frozen=True)
class StudyReport:
    """What a study came to.

    Args:
        study: Name of the study, as in ``slap study``.
        source: Figure or table of the paper that the study reproduces; empty where there is none.
        title: Title of the page.
        measured: Text on what the numbers are, and on all that readers must know; Markdown.
        table: Table of the numbers.
        found: All numbers in full, as JSON data.
        draw: Function that draws the picture.
        size: Size of the picture.
        circumstances: Facts that no command decides, such as the day on which a model answered; by
            name.
    """

    study: str
    source: str
    title: str
    measured: str
    table: MarkdownTable
    found: Data
    draw: Callable[[Figure], None]
    size: Size
    circumstances: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Provenance:
    """The inputs that a report was made from.

    Args:
        domain: Name of the domain.
        command: Command that makes the report again.
        settings: Everything else that the report depends on, as JSON data.
    """

    domain: str
    command: str
    settings: Data

    @classmethod
    def of_command(cls, study: str, domain: str, settings: Data, given: Data) -> Provenance:
        """What ``slap study`` makes a report from.

        Args:
            study: Name of the study, as in ``slap study``.
            domain: Name of the domain.
            settings: Settings that the report names, and the command repeats.
            given: Options that the command has besides, or states otherwise than the report.
        """
        options = {**given, **settings, **given}  # in the order in which commands have them
        return cls(domain, command_line("study", study, domain, **options), settings)

    def as_json(self) -> dict[str, Any]:
        """Domain, settings, command and versions, for the report's JSON."""
        return {
            "domain": self.domain,
            **self.settings,
            "command": self.command,
            "versions": dict(versions()),
        }


def require_replaceable(folder: Path, study: str, origin: Provenance) -> None:
    """Check that a report may be written: there is none yet, or that of the same command.

    Args:
        folder: Folder for the report.
        study: Name of the study, as in ``slap study``.
        origin: Inputs that the report will be made from.

    Raises:
        InvalidParameterError: There is data of another command, or something else.
    """
    path = folder / f"{study}_{origin.domain}.json"
    if not path.exists():
        return
    try:
        command = parse_json(read_text(path))["command"]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise InvalidParameterError(
            f"{path} exists and is no data of a study ({error!r}); give another --output, or "
            "remove it"
        ) from error
    if command != origin.command:
        raise InvalidParameterError(
            f"{path} has the data of `{command}`; give another --output, or remove it"
        )


def write(folder: Path, report: StudyReport, origin: Provenance, cpu_seconds: float) -> list[Path]:
    """Write a report's files, in place of those of an earlier one.

    Args:
        folder: Folder for the files; it is made if need be.
        report: Report to write.
        origin: Inputs that the report was made from.
        cpu_seconds: CPU time that the study took, s.

    Returns:
        The files: JSON, SVG and Markdown.
    """
    name = f"{report.study}_{origin.domain}"
    data = {
        "study": report.study,
        "source": report.source,
        **origin.as_json(),
        **report.circumstances,
        "cpu_seconds": round(cpu_seconds, 2),
        "found": report.found,
    }
    contents = {
        "json": pretty_json(data) + "\n",
        "svg": picture(report.draw, report.size),
        "md": _page(name, report, origin),
    }
    paths = []
    for ending, content in contents.items():
        paths.append(folder / f"{name}.{ending}")
        write_whole(paths[-1], content)
    return paths


def _page(name: str, report: StudyReport, origin: Provenance) -> str:
    data = f"[{name}.json]({name}.json)"
    named = {**origin.settings, **report.circumstances}
    settings = [f"- {key}: {_said(value)}" for key, value in named.items()]
    listed = "\n".join([*settings, f"- versions and all numbers: {data}"])
    after = (
        f"After {report.source}. Numbers are this system's, except where the paper's are named."
        if report.source
        else "No paper has these figures. All numbers are this system's."
    )
    return f"""\
# {report.title}

{after}

![{report.title}]({name}.svg)

{report.measured}

{report.table.as_markdown()}

## How to make it again

    {origin.command}

{listed}
"""


def _said(value: object) -> str:
    """A setting in words."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_said(part)}" for key, part in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_said, value))
    return f"`{value}`"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
