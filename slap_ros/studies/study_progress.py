# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study calls while it is under way."""

from __future__ import annotations

from typing import Protocol


class StudyProgress(Protocol):
    """Is called as the jobs of a study begin and end, to show its progress."""

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        ...

    def advance(self) -> None:
        """One of them has ended."""
        ...

    def report_failure(self, complaint: str) -> None:
        """A task was not solved, and why."""
        ...
