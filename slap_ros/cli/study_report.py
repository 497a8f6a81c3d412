# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How ``slap study`` makes a report: begun, followed by bars, and written."""

from __future__ import annotations

from pathlib import Path

from rich.progress import TaskID

from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console, warn
from slap_ros.files import require_writable
from slap_ros.studies.figures import require_matplotlib
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.results import Provenance, require_replaceable, write
from slap_ros.studies.study import Options, Study
from slap_ros.studies.study_log import StudyLog


def require_report(output: Path) -> None:
    """Check that a report can be drawn and written, before hours are spent.

    Raises:
        InvalidParameterError: Matplotlib is not installed.
        OSError: ``output`` is no place for files.
    """
    require_matplotlib()
    require_writable(output)


def make_report(study: Study[Options], options: Options) -> None:
    """Make the report of a study and write it. After an interruption, the same command goes on.

    Args:
        study: Study to make.
        options: Options of its command.

    Raises:
        BusyError: Another process makes it.
        InvalidParameterError: What is done so far is of another study, or the data there is.
        OSError: Nothing can be written there.
    """
    require_report(options.output)
    prepared = study.prepare(options, warn)
    origin = Provenance.of_command(study.name, options.domain, prepared.settings, prepared.given)
    require_replaceable(options.output, study.name, origin)
    with StudyLog(options.output / f".{study.name}_{origin.domain}.jsonl", origin) as log:
        with StudyBars() as bars:
            report = prepared.make(JobRunner(log, options.jobs, bars))
        paths = write(options.output, report, origin, log.cpu_seconds)
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
