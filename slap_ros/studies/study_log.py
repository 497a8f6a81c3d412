# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study that is under way has found, on disk: whoever stops it goes on from there."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text
from slap_ros.learning.workers import SequentialWorkers, Workers, local_workers
from slap_ros.studies.comparison import StudyProgress


class StudyLog:
    """A file of JSON lines: what the study is, then an entry per result, as they come."""

    def __init__(self, path: Path, command: str) -> None:
        """Open the log of a study; the file begins with its first entry.

        Args:
            path: Of the file.
            command: What makes the study; a log of another one is refused.

        Raises:
            InvalidParameterError: It is the log of another study, or none.
            OSError: It cannot be read.
        """
        self._path = path
        self._command = command
        self.found: list[Any] = []  # the entries that were there already
        if path.exists():
            self._read(command)

    def append(self, entry: Mapping[str, Any]) -> None:
        """Write an entry.

        Raises:
            OSError: It cannot be written.
        """
        lines = [entry]
        if not self._path.exists():
            self._path.parent.mkdir(parents=True, exist_ok=True)
            lines = [{"command": self._command}, entry]
        with self._path.open("a", encoding="utf-8") as file:
            file.write("".join(json.dumps(line) + "\n" for line in lines))

    def remove(self) -> None:
        """Remove the file, once its study is written."""
        self._path.unlink(missing_ok=True)

    def _read(self, command: str) -> None:
        try:
            header, *self.found = self._lines()
            known = header["command"]
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidParameterError(
                f"{self._path} is no log of a study ({error}); remove it"
            ) from error
        if known != command:
            raise InvalidParameterError(
                f"{self._path} is what `{known}` has done so far; go on with that command, or "
                "remove the file"
            )

    def _lines(self) -> Iterator[Any]:
        """Every whole line; the last one is cut off where the study was killed as it wrote."""
        text = read_text(self._path)
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            self._path.write_text(whole, encoding="utf-8")
        return map(parse_json, whole.splitlines())


def _workers(processes: int) -> AbstractContextManager[Workers]:
    return local_workers(processes) if processes > 1 else nullcontext(SequentialWorkers())


Job = tuple[Any, ...]  # the arguments of a function


class JobLog(StudyLog):
    """Results of jobs, each a function of its arguments, by the job's name."""

    def __init__(self, path: Path, command: str) -> None:
        """Open the log of a study, or begin it; see :class:`StudyLog`."""
        super().__init__(path, command)
        self._results = {entry["job"]: entry["result"] for entry in self.found}

    def run(
        self,
        what: str,
        function: Callable[..., Any],
        jobs: Mapping[str, Job],
        processes: int,
        progress: StudyProgress,
    ) -> dict[str, Any]:
        """Do the jobs that were not done before.

        Args:
            what: They are, for the progress bar.
            function: Does a job and returns what JSON can hold; importable by its name.
            jobs: Its arguments, by the job's name.
            processes: How many run at a time.
            progress: Is called as jobs end.

        Returns:
            The results, in the order of ``jobs``.
        """
        waiting = [name for name in jobs if name not in self._results]
        progress.begin(what, len(jobs))
        for _ in range(len(jobs) - len(waiting)):
            progress.advance()
        if waiting:
            with _workers(processes) as workers:
                for i, result in workers.run(function, [jobs[name] for name in waiting]):
                    self._results[waiting[i]] = result
                    self.append({"job": waiting[i], "result": result})
                    progress.advance()
        return {name: self._results[name] for name in jobs}
