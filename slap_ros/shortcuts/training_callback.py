# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The events of a training, to be shown or recorded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from slap_ros.learning.progress_callback import ProgressCallback
from slap_ros.shortcuts.candidate_groups import CandidateGroup


@runtime_checkable
class TrainingCallback(ProgressCallback, Protocol):
    """Receives the events of a training."""

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """A task has no plan, and training goes on without it.

        Args:
            use: Purpose of the task: validation or exploration.
            index: Index of the task, with the seed of training tasks.
            reason: Reason why the task has no plan, in words.
        """
        ...

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """Exploration is over; these are worth learning, the most promising first."""
        ...

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """A shortcut is about to be learned.

        Args:
            name: Name of the shortcut.
            folder: Folder with the progress of the shortcut; see
                :class:`~slap_ros.shortcuts.work_folder.ShortcutWorkFolder`.
            total_steps: Environment steps that learning the shortcut takes.
        """
        ...

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """A shortcut was learned, and tried on validation tasks.

        Args:
            name: Name of the shortcut.
            before: Mean plan length without the shortcut, environment steps.
            after: Mean plan length with the shortcut, environment steps; infinite where a task was
                not solved.
            kept: Whether the shortcut becomes part of the library.
        """
        ...
