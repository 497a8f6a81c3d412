# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of a result that is under way, each kept as soon as it has ended.

A result of a :class:`~slap_ros.learning.work_folder.WorkFolder` may take many jobs, which take
minutes each. Until all have ended, what they came to is in a file beside the result: a line of JSON
for each. An interrupted command goes on after the jobs that have ended, to the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from slap_ros.learning.json_lines import append_line, decoded_lines
from slap_ros.learning.work_folder import WorkFolder

Result = TypeVar("Result")


@dataclass(frozen=True)
class FinishedJobs:
    """What jobs have come to so far, on disk.

    Args:
        path: Path of the file, which need not exist.
    """

    path: Path

    def of(self, step: str) -> dict[int, Any]:
        """Results of a step's jobs that have ended, by the number of the job.

        Args:
            step: Name of the step that the jobs are, in words.

        Raises:
            InvalidParameterError: The file is damaged.
        """
        if not self.path.exists():
            return {}
        entries = decoded_lines(self.path, _entry, "remove it to have it made again")
        return {number: result for whose, number, result in entries if whose == step}

    def add(self, step: str, number: int, result: Any) -> None:
        """Keep what a job has come to.

        Args:
            step: Name of the step that the job is part of, in words.
            number: Number of the job in the step, from 0.
            result: Result, in a form that JSON can hold.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        append_line(self.path, {"step": step, "job": number, "result": result})

    def remove(self) -> None:
        """Remove the file, once the whole result is written."""
        self.path.unlink(missing_ok=True)


def _entry(line: Mapping[str, Any]) -> tuple[str, int, Any]:
    """Step, number and result of a job."""
    return str(line["step"]), int(line["job"]), line["result"]


def cached_jobs(
    work: WorkFolder,
    name: str,
    compute: Callable[[FinishedJobs], Any],
    decode: Callable[[Any], Result],
) -> Result:
    """A result from a work folder, or computed by jobs and put there.

    Args:
        work: Work folder of the result.
        name: Name of the result's file, without its ending; a folder may precede it.
        compute: Function that computes the result, as JSON, after the jobs that have ended.
        decode: Function that converts the JSON into the result.

    Returns:
        The result, decoded.

    Raises:
        InvalidParameterError: What is in the folder is damaged.
    """
    whole = work.path / name
    finished = FinishedJobs(whole.with_name(f".{whole.name}.jsonl"))
    result = work.cached(name, lambda: compute(finished), decode)
    finished.remove()
    return result
