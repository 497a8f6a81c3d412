# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study that is under way has found, on disk: whoever stops it goes on from there."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_bytes, require_regular, require_sole_use
from slap_ros.learning.json_lines import cut_off_half_a_line, whole_lines
from slap_ros.studies.results import Provenance


class StudyLog:
    """A file of JSON lines: which study it is, then the result of a job per line, as they end.

    A context manager. There is a file from the first result on, and while it is open, no other
    process opens it.
    """

    def __init__(self, path: Path, origin: Provenance) -> None:
        """Open the log of a study.

        Args:
            path: Path of the file.
            origin: Inputs of the study; a log with other inputs is refused.

        Raises:
            BusyError: Another process has it open.
            InvalidParameterError: It is the log of another study, or none.
            OSError: It cannot be read or written.
        """
        self.path = path
        self.origin = origin
        self.results: dict[str, Any] = {}  # by the job's name
        self.cpu_seconds = 0.0  # of all jobs so far
        self._header = {"command": origin.command, "settings": origin.settings}
        self._file: BinaryIO | None = None
        if path.exists():
            self._file = self._open()

    def __enter__(self) -> StudyLog:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def add(self, job: str, result: Any, cpu_seconds: float) -> None:
        """Write what a job came to.

        Args:
            job: Name of the job.
            result: Result, in a form that JSON can hold.
            cpu_seconds: CPU time that the job took, s.

        Raises:
            BusyError: Another process began the same study and had a result before.
            InvalidParameterError: Another one did, has ended, and left the log of another study.
            OSError: It cannot be written.
        """
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._open()
        if not self.results:
            self._file.truncate(0)
            self._file.write(_line(self._header))
        self._file.write(_line({"job": job, "result": result, "cpu_seconds": cpu_seconds}))
        self._file.flush()
        self.results[job] = result
        self.cpu_seconds += cpu_seconds

    def remove(self) -> None:
        """Remove the file, once its study is written."""
        self.path.unlink(missing_ok=True)

    def _open(self) -> BinaryIO:
        """Open the file, made where there is none, and read what it has."""
        if self.path.exists():
            require_regular(self.path)
        with ExitStack() as unless_refused:
            file = unless_refused.enter_context(self.path.open("a+b"))
            require_sole_use(file.fileno(), self.path)
            self._read(file)
            unless_refused.pop_all()
        return file

    def _read(self, file: BinaryIO) -> None:
        """Read the results, and cut off a last line that is not whole."""
        try:
            lines = whole_lines(self.path)
            # A process that was killed early left half of the first line, or nothing.
            if lines or not _line(self._header).startswith(read_bytes(self.path)):
                header, *entries = lines
                self._require_same(header["command"], header.get("settings"))
                self.results = {str(entry["job"]): entry["result"] for entry in entries}
                # Logs of version 0.1.0 do not have it.
                self.cpu_seconds = sum(float(entry.get("cpu_seconds", 0.0)) for entry in entries)
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise InvalidParameterError(
                f"{self.path} is no log of a study ({error!r}); remove it"
            ) from error
        cut_off_half_a_line(file)

    def _require_same(self, command: str, settings: Any) -> None:
        if command != self._header["command"]:
            raise InvalidParameterError(
                f"{self.path} is what `{command}` has done so far; go on with that command, or "
                "remove the file"
            )
        if settings != parse_json(_line(self._header["settings"])):
            raise InvalidParameterError(
                f"{self.path} is what this command has done so far with another library or other "
                "settings; remove the file to begin again"
            )


def _line(data: Any) -> bytes:
    return json.dumps(data).encode() + b"\n"
