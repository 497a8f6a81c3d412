# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a benchmark writes its page, if it is to write one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slap_ros.studies.figures import require_matplotlib
from slap_ros.studies.results import Provenance, StudyReport, require_replaceable, write


@dataclass(frozen=True)
class PageOutput:
    """A folder for the page, the picture and the data of a benchmark; or none.

    Args:
        folder: Folder for the files; None where figures are printed only.
        study: Name of the benchmark, with which names of files begin.
        source: Inputs of the benchmark.
    """

    folder: Path | None
    study: str
    source: Provenance

    def __post_init__(self) -> None:
        """Refuse to begin what could not be written in the end.

        Raises:
            InvalidParameterError: matplotlib is missing, or the files are of another command.
        """
        if self.folder is not None:
            require_matplotlib()
            require_replaceable(self.folder, self.study, self.source)

    def write(self, report: StudyReport, cpu_seconds: float) -> None:
        """Write the files, if there is a folder for them.

        Args:
            report: What the benchmark came to.
            cpu_seconds: CPU time that it took, s.
        """
        if self.folder is not None:
            write(self.folder, report, self.source, cpu_seconds)
