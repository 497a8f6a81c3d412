# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The trials of a study that is under way."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from slap_ros.evaluation.experiment import Trial
from slap_ros.planning.execution import ExecutedEdge
from slap_ros.studies.study_log import StudyLog

Key = tuple[str, str, str]  # preset, library (name and digest, or nothing), approach


class TrialLog(StudyLog):
    """The trials of a study: a line per trial, written as trials end."""

    def __init__(self, path: Path, command: str) -> None:
        """Open the log of a study, or begin it; see :class:`StudyLog`."""
        super().__init__(path, command)
        self._trials: dict[Key, list[Trial]] = {}
        for entry in self.found:
            self._trials.setdefault(tuple(entry["key"]), []).append(_trial(entry["trial"]))

    def trials(self, key: Key) -> list[Trial]:
        """The trials so far of a preset, library and approach."""
        return list(self._trials.get(key, ()))

    def add(self, key: Key, trial: Trial) -> None:
        """Write a trial that has ended."""
        self._trials.setdefault(key, []).append(trial)
        self.append({"key": key, "trial": asdict(trial)})


def _trial(data: dict[str, Any]) -> Trial:
    edges = tuple(
        ExecutedEdge(**edge | {"objects": tuple(edge["objects"])}) for edge in data["edges"]
    )
    return Trial(**data | {"edges": edges})
