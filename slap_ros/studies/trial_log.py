# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The trials of a study that is under way, on disk: whoever stops it goes on from there."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.experiment import Trial
from slap_ros.files import parse_json, read_text
from slap_ros.planning.execution import ExecutedEdge

Key = tuple[str, str, str]  # preset, library (name and digest, or nothing), approach


class TrialLog:
    """A file of JSON lines: what the study is, then a line per trial, written as trials end."""

    def __init__(self, path: Path, command: str) -> None:
        """Open the log of a study, or begin it.

        Args:
            path: Of the file.
            command: What makes the study; a log of another one is refused.

        Raises:
            InvalidParameterError: It is the log of another study, or none.
            OSError: It cannot be read or written.
        """
        self._path = path
        self._trials: dict[Key, list[Trial]] = {}
        if path.exists():
            self._read(command)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._append({"command": command})

    def trials(self, key: Key) -> list[Trial]:
        """The trials so far of a preset, library and approach."""
        return list(self._trials.get(key, ()))

    def add(self, key: Key, trial: Trial) -> None:
        """Write a trial that has ended."""
        self._trials.setdefault(key, []).append(trial)
        self._append({"key": key, "trial": asdict(trial)})

    def remove(self) -> None:
        """Remove the file, once its study is written."""
        self._path.unlink(missing_ok=True)

    def _append(self, data: dict[str, Any]) -> None:
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(data) + "\n")

    def _read(self, command: str) -> None:
        try:
            header, *rest = self._lines()
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
        for line in rest:
            self._trials.setdefault(tuple(line["key"]), []).append(_trial(line["trial"]))

    def _lines(self) -> Iterator[Any]:
        """Every whole line; the last one is cut off where the study was killed as it wrote."""
        text = read_text(self._path)
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            self._path.write_text(whole, encoding="utf-8")
        return map(parse_json, whole.splitlines())


def _trial(data: dict[str, Any]) -> Trial:
    edges = tuple(
        ExecutedEdge(**edge | {"objects": tuple(edge["objects"])}) for edge in data["edges"]
    )
    return Trial(**data | {"edges": edges})
