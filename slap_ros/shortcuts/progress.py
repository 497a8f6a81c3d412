# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the learning of a shortcut goes: figures after each rollout, and checkpoints."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Protocol

from slap_ros.shortcuts.stored_keys import stored
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

CHECKPOINT_S = 30.0  # between checkpoints


@dataclass(frozen=True)
class Progress:
    """Figures of a training; rates and lengths are those of recent episodes.

    Args:
        steps: Environment steps so far.
        episodes: Episodes that ended so far.
        success: Share of episodes that reached the target.
        length: Mean environment steps of successful episodes; NaN where there is none.
        failure: Share of episodes after which the target could not be reached any more.
        shortest: Environment steps of the shortest success so far; the horizon where there is
            none.
    """

    steps: int
    episodes: int
    success: float
    length: float
    failure: float
    shortest: int


class Checkpointed(Protocol):
    """A learner whose state can be saved."""

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        ...


class ProgressRecorder:
    """Appends figures to the progress file, and saves checkpoints now and then."""

    def __init__(self, folder: ShortcutWorkFolder) -> None:
        self._folder = folder
        self._began = self._saved = monotonic()
        self._cpu_s = _cpu_s()
        self._latest: dict[int, Progress] = {}

    def of(self, stage: int, learner: Checkpointed) -> Callable[[Progress], bool]:
        """What is called after each rollout of a stage; it answers yes: learning continues."""

        def report(progress: Progress) -> bool:
            self._latest[stage] = progress
            seconds = monotonic() - self._began
            self._folder.append({"stage": stage, **stored(progress), "seconds": seconds})
            if monotonic() - self._saved > CHECKPOINT_S:
                learner.save(self._folder.checkpoint(stage))
                self._saved = monotonic()
            return True

        return report

    def record(self) -> dict[str, str | int | float]:
        """Figures by name; success and length are those of the last episodes, with noise."""
        if not self._latest:  # all stages were over before
            return {}
        last = self._latest[max(self._latest)]
        return {
            "environment_steps": sum(progress.steps for progress in self._latest.values()),
            "episodes": sum(progress.episodes for progress in self._latest.values()),
            "success": last.success,
            "length": last.length if last.length == last.length else -1.0,
            "cpu_s": _cpu_s() - self._cpu_s,
        }


def _cpu_s() -> float:
    """Of this process, and of those that it started and that have ended."""
    return sum(os.times()[:4])
