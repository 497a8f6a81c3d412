# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the commands of ``slap study`` share: how a report is begun, made and written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import TaskID

from slap_ros.api.command_line import command_line
from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console
from slap_ros.cli.options import MAX_SEED, at_most
from slap_ros.files import require_writable
from slap_ros.studies.figures import require_matplotlib
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.results import Data, Provenance, StudyReport, require_replaceable, write
from slap_ros.studies.study_log import StudyLog

RESULTS = Path("docs/results")
FRESH_SEED = 500  # development looks at no task seed from here on

FreshSeed = Annotated[
    int, typer.Option(min=0, callback=at_most(MAX_SEED), help="Seed of the tasks.")
]
Output = Annotated[Path, typer.Option(help="Folder for the files STUDY_DOMAIN.json, .svg and .md.")]


def require_report(output: Path) -> None:
    """Check that a report can be drawn and written, before hours are spent.

    Raises:
        InvalidParameterError: Matplotlib is not installed.
        OSError: ``output`` is no place for files.
    """
    require_matplotlib()
    require_writable(output)


def provenance(study: str, domain: str, settings: Data, **given: Any) -> Provenance:
    """From what a report is made.

    Args:
        study: Name of the study, as in ``slap study``.
        domain: Name of the domain.
        settings: What the report names, and the command repeats.
        given: What the command has besides, or says otherwise than the report.

    Returns:
        The settings, and the command that makes the report again.
    """
    return Provenance(
        domain, command_line("study", study, domain, **{**given, **settings, **given}), settings
    )


def make_report(
    study: str,
    origin: Provenance,
    output: Path,
    jobs: int,
    make: Callable[[JobRunner], StudyReport],
) -> None:
    """Make a report and write it. Whoever stops it goes on with the same command.

    Args:
        study: Name of the study, as in ``slap study``.
        origin: From what it is made.
        output: Folder for its files, and until they are written for what is done so far.
        jobs: Number of processes.
        make: Makes the report.

    Raises:
        BusyError: Another process makes it.
        InvalidParameterError: What is done so far is of another study, or the data there is.
        OSError: Nothing can be written there.
    """
    require_replaceable(output, study, origin)
    with StudyLog(output / f".{study}_{origin.domain}.jsonl", origin) as log:
        with StudyBars() as bars:
            report = make(JobRunner(log, jobs, bars))
        paths = write(output, report, origin, log.cpu_seconds)
        console.print(f"{report.title}: {', '.join(map(str, paths))}")
        log.remove()


class StudyBars:
    """How far a study is, one bar per kind of jobs."""

    def __init__(self) -> None:
        self._bars = counting_bars()
        self._bar: TaskID | None = None

    def __enter__(self) -> StudyBars:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        if self._bar is not None:
            self._bars.remove_task(self._bar)
        self._bar = self._bars.add_task(what, total=total)

    def advance(self) -> None:
        """One of them has ended."""
        if self._bar is not None:
            self._bars.advance(self._bar)

    def report_failure(self, complaint: str) -> None:
        """A task was not solved, and why."""
        console.print(complaint)
