# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The calls of a study that show its progress."""

from __future__ import annotations

from typing import Protocol


class StudyProgress(Protocol):
    """A display of progress, called as the jobs of a study begin and end."""

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        ...

    def advance(self) -> None:
        """One of the jobs has ended."""
        ...

    def report_failure(self, complaint: str) -> None:
        """A task was not solved, and why."""
        ...
