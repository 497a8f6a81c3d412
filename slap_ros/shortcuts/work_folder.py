# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a training keeps on disk, so that the same command continues where it was interrupted.

::

    runs/models/obstacle2d-training/
      settings.json              what the training is of
      explored.json, plans.json  results of its steps
      .explored.jsonl            tasks of a step that is under way, as they end
      Clear_On-e41568a9/         a shortcut being learned
        starts.json
        progress.jsonl, plan_lengths.jsonl, tensorboard/, checkpoint0.pt
        snapshots/100352/Clear_On-e41568a9/  the shortcut after so many environment steps
        finished                 exists once the shortcut is learned
        Clear_On-e41568a9/       the shortcut, as in a library
      attempt2/Clear_On-e41568a9/  the same of a second attempt; see TrainingSettings.attempts
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.learning.json_lines import append_line


def attempt_folder(folder: Path, name: str, attempt: int) -> Path:
    """The folder in which a shortcut is learned.

    Args:
        folder: Work folder of the training.
        name: Name of the shortcut.
        attempt: Number of the attempt, counted from 0.
    """
    return folder / f"attempt{attempt + 1}" / name if attempt else folder / name


@dataclass(frozen=True)
class ShortcutWorkFolder:
    """The part of a work folder in which one shortcut is learned; made where there is none."""

    path: Path

    def __post_init__(self) -> None:
        self.path.mkdir(parents=True, exist_ok=True)

    @property
    def shortcut(self) -> Path:
        """The learned shortcut, as in a library, where a folder is named after the signature."""
        return self.path / self.path.name

    def checkpoint(self, stage: int) -> Path:
        """The file with the state of PPO in a stage, which is counted from 0."""
        return self.path / f"checkpoint{stage}.pt"

    def snapshot(self, steps: int) -> Path:
        """The shortcut as it was after so many environment steps, as in a library."""
        return self.path / "snapshots" / str(steps) / self.path.name

    @property
    def snapshots(self) -> list[int]:
        """The environment steps after which there is a snapshot, in ascending order."""
        return sorted(int(folder.name) for folder in self.path.glob("snapshots/[0-9]*"))

    @property
    def finished(self) -> Path:
        """A file that exists once the shortcut is learned."""
        return self.path / "finished"

    @property
    def progress(self) -> Path:
        """The file of progress: a JSON object per line, one for each rollout."""
        return self.path / "progress.jsonl"

    @property
    def plan_lengths(self) -> Path:
        """The file of validations while the shortcut is learned: a JSON object per line."""
        return self.path / "plan_lengths.jsonl"

    def append(self, progress: Mapping[str, Any]) -> None:
        """Add a line to the progress; NaN, where there is no number yet, as null."""
        plain = {k: None if v != v else v for k, v in progress.items()}
        append_line(self.progress, plain)
