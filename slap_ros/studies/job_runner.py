# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How studies do what takes long: jobs in processes, each result kept at once."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any, TypeVar

from slap_ros.files import parse_json
from slap_ros.learning.work_folder import DECODING_ERRORS, damaged
from slap_ros.learning.workers import SequentialWorkers, Workers, local_workers
from slap_ros.studies.study_log import StudyLog
from slap_ros.studies.study_progress import StudyProgress

Job = tuple[Any, ...]  # the arguments of a function
Result = TypeVar("Result")


@dataclass(frozen=True)
class JobRunner:
    """Does the jobs of a study; what a log has already is not done again.

    Args:
        log: Log that keeps the results.
        processes: Largest number of jobs at a time.
        progress: Progress display, called as jobs begin and end.
    """

    log: StudyLog
    processes: int
    progress: StudyProgress

    def checkpoints(self, output: Path, study: str) -> Path:
        """Folder for the checkpoints of this command alone: those of others are of other trainings.

        Args:
            output: Folder that the report is written to.
            study: Name of the study and its domain.
        """
        digest = sha256(self.log.origin.command.encode()).hexdigest()[:8]
        return output / f".{study}-{digest}"

    def run(
        self,
        what: str,
        function: Callable[..., Any],
        decode: Callable[[Any], Result],
        *batches: Mapping[str, Job],
        failure: Callable[[Result], str | None] = lambda _: None,
    ) -> dict[str, Result]:
        """Do the jobs that were not done before.

        Several batches are done one after the other, and have processes of their own: what one has
        in its caches would make another faster than it is.

        Args:
            what: Name of the jobs for the progress bar.
            function: Function that does a job and returns what JSON can hold, or a dataclass of
                that; importable by its name, for other processes.
            decode: Function that makes a result of its JSON.
            batches: Arguments of jobs, by the job's name, which no other job of the study has.
            failure: Function that gives the complaint about a job that failed; None for one that
                did not.

        Returns:
            The results by the job's name, in the order of ``batches``.

        Raises:
            InvalidParameterError: The log has a result that is none of such a job.
        """
        jobs = {name: job for batch in batches for name, job in batch.items()}
        found: dict[str, Result] = {}

        def ended(name: str) -> None:
            found[name] = self._decoded(name, decode)
            self.progress.advance()
            if (said := failure(found[name])) is not None:
                self.progress.report_failure(f"{name} {said}")

        self.progress.begin(what, len(jobs))
        for name in jobs:
            if name in self.log.results:
                ended(name)
        for batch in batches:
            left = [name for name in batch if name not in found]
            if left:
                with self._workers(apart=len(batches) > 1) as workers:
                    work = [(function, batch[name]) for name in left]
                    for i, (result, seconds) in workers.run(_timed, work):
                        plain = parse_json(json.dumps(result, default=asdict))
                        self.log.add(left[i], plain, seconds)
                        ended(left[i])
        return {name: found[name] for name in jobs}

    def _decoded(self, name: str, decode: Callable[[Any], Result]) -> Result:
        """The result, always from JSON, so that results are alike if the study was interrupted."""
        try:
            return decode(self.log.results[name])
        except DECODING_ERRORS as error:
            where = f"{self.log.path}, {name!r}"
            raise damaged(where, error, "remove the file to begin again") from error

    def _workers(self, apart: bool) -> AbstractContextManager[Workers]:
        """Processes, or this one where a single one is enough and need not be a new one."""
        if self.processes == 1 and not apart:
            return nullcontext(SequentialWorkers())
        return local_workers(self.processes)


def _timed(function: Callable[..., Any], job: Job) -> tuple[Any, float]:
    """The result of a job, and the CPU time that it took, s."""
    before = _cpu_seconds()
    result = function(*job)
    return result, _cpu_seconds() - before


def _cpu_seconds() -> float:
    """CPU time of this process, and of those that it started and that have ended, s."""
    usages = getrusage(RUSAGE_SELF), getrusage(RUSAGE_CHILDREN)
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)
