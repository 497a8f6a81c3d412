# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study that is under way has found, on disk: whoever stops it goes on from there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text
from slap_ros.studies.results import Provenance


class StudyLog:
    """A file of JSON lines: which study it is, then the result of a job per line, as they end."""

    def __init__(self, path: Path, origin: Provenance) -> None:
        """Open the log of a study; there is a file from the first result on.

        Args:
            path: Of the file.
            origin: From what the study is made; a log of another one is refused.

        Raises:
            InvalidParameterError: It is the log of another study, or none.
            OSError: It cannot be read.
        """
        self.path = path
        self.results: dict[str, Any] = {}  # by the job's name
        self.cpu_seconds = 0.0  # of all jobs so far
        self._header = {"command": origin.command, "settings": origin.settings}
        self._begun = path.exists() and self._read()

    def add(self, job: str, result: Any, cpu_seconds: float) -> None:
        """Write what a job came to.

        Args:
            job: Its name.
            result: What JSON can hold.
            cpu_seconds: Of the processor, that it took.

        Raises:
            OSError: It cannot be written.
        """
        lines = [{"job": job, "result": result, "cpu_seconds": cpu_seconds}]
        if not self._begun:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lines.insert(0, self._header)
        with self.path.open("a" if self._begun else "w", encoding="utf-8") as file:
            file.write("".join(map(_line, lines)))
        self._begun = True
        self.results[job] = result
        self.cpu_seconds += cpu_seconds

    def remove(self) -> None:
        """Remove the file, once its study is written."""
        self.path.unlink(missing_ok=True)

    def _read(self) -> bool:
        """Whether the file has more than the beginning of its first line."""
        try:
            text = read_text(self.path)
            whole = text[: text.rfind("\n") + 1]
            if not whole and _line(self._header).startswith(text):
                return False
            header, *entries = map(parse_json, whole.splitlines())
            self._require_same(header["command"], header.get("settings"))
            self.results = {str(entry["job"]): entry["result"] for entry in entries}
            # Logs of version 0.1.0 do not have it.
            self.cpu_seconds = sum(float(entry.get("cpu_seconds", 0.0)) for entry in entries)
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise InvalidParameterError(
                f"{self.path} is no log of a study ({error!r}); remove it"
            ) from error
        if whole != text:  # killed as it wrote the last line
            self.path.write_text(whole, encoding="utf-8")
        return True

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


def _line(data: Any) -> str:
    return json.dumps(data) + "\n"
