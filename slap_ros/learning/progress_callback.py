# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every training tells as it goes on, whether it learns shortcuts or skills."""

from __future__ import annotations

from typing import Protocol


class ProgressCallback(Protocol):
    """Receives how far the steps of a training are."""

    def on_progress(self, what: str, done: int, total: int) -> None:
        """Some of a step's jobs are done.

        Args:
            what: Name of the step, in words.
            done: Number of jobs done so far; 0 as the step begins.
            total: Number of jobs of the step.
        """
        ...
