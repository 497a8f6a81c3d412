# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the learning of a shortcut goes: figures after each rollout, and checkpoints."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import nan
from pathlib import Path
from time import monotonic
from typing import Any, Protocol, TypeVar

from slap_ros.learning.json_lines import decoded_lines
from slap_ros.learning.stored_keys import restored, stored
from slap_ros.learning.success_curve import SUCCESS_CURVE, SuccessPoint, success_curve
from slap_ros.policies.library_files import replace_folder
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import save_shortcut
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

T = TypeVar("T")
CHECKPOINT_S = 30.0  # time between checkpoints
SNAPSHOTS = 12  # approximate number of snapshots of a shortcut while it is learned


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


NOTHING_YET = Progress(steps=0, episodes=0, success=0.0, length=nan, failure=0.0, shortest=0)


def latest(folder: ShortcutWorkFolder) -> dict[int, Progress]:
    """The last figures of each stage that were written; a line that is not whole is left out.

    Raises:
        InvalidParameterError: The file is damaged.
    """
    return dict(_lines(folder, lambda one: (int(one["stage"]), _restored(one))))


def _lines(folder: ShortcutWorkFolder, decode: Callable[[Mapping[str, Any]], T]) -> Iterable[T]:
    """What the lines of a progress file hold; nothing where there is none."""
    if not folder.progress.exists():
        return ()
    return decoded_lines(folder.progress, decode, "remove the folder to learn the shortcut again")


def _success(line: Mapping[str, Any]) -> tuple[int, SuccessPoint]:
    """Stage and success in a line of a progress file."""
    return int(line["stage"]), SuccessPoint(int(line["steps"]), float(line["success"]))


def _cpu_s_before(folder: ShortcutWorkFolder) -> float:
    """Processor time of all processes that learned in a folder, s; 0 of versions before 0.2."""
    return max(_lines(folder, lambda one: float(one.get("cpu_s", 0.0))), default=0.0)


def _restored(line: Mapping[str, Any]) -> Progress:
    """The figures in a line of a progress file; no length is NaN again."""
    figures: dict[str, Any] = restored(Progress, {key: line[key] for key in stored(NOTHING_YET)})
    length = figures.pop("length")
    return Progress(**figures, length=nan if length is None else length)


class SavableLearner(Protocol):
    """A learner whose state can be saved."""

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        ...

    def policy(self) -> MlpPolicy:
        """The policy as it is now."""
        ...

    @property
    def shortest(self) -> int:
        """Environment steps of the shortest success; the horizon where there is none."""
        ...


class ProgressRecorder:
    """Appends figures to the progress file, and saves checkpoints now and then."""

    def __init__(self, folder: ShortcutWorkFolder) -> None:
        """Go on from what is in a folder."""
        self._folder = folder
        self._began = self._saved = monotonic()
        self._cpu_s_at_start = _cpu_s() - _cpu_s_before(folder)  # as if it had done all of it
        self._latest = latest(folder)

    def of(self, stage: int, learner: SavableLearner) -> Callable[[Progress], bool]:
        """The function to call after each rollout of a stage; it returns that learning goes on."""

        def report(progress: Progress) -> bool:
            self._latest[stage] = progress
            times = {"seconds": monotonic() - self._began, "cpu_s": self._cpu_s}
            self._folder.append({"stage": stage, **stored(progress), **times})
            if monotonic() - self._saved > CHECKPOINT_S:
                learner.save(self._folder.checkpoint(stage))
                self._saved = monotonic()
            self.after_rollout(learner)
            return True

        return report

    def after_rollout(self, learner: SavableLearner) -> None:
        """Do what is done after a rollout besides; here nothing."""

    @property
    def _steps(self) -> int:
        """Environment steps of all stages so far."""
        return sum(progress.steps for progress in self._latest.values())

    @property
    def _cpu_s(self) -> float:
        """Processor time so far, s, that of interrupted processes included."""
        return _cpu_s() - self._cpu_s_at_start

    def record(self) -> dict[str, Any]:
        """The figures by name; success and length are those of the last episodes, with noise."""
        last = self._latest[max(self._latest)]
        return {
            "environment_steps": self._steps,
            "episodes": sum(progress.episodes for progress in self._latest.values()),
            "success": last.success,
            "length": last.length if last.length == last.length else -1.0,
            "cpu_s": self._cpu_s,
            SUCCESS_CURVE: success_curve(_lines(self._folder, _success)),
        }


class SnapshotRecorder(ProgressRecorder):
    """Keeps the shortcut now and then besides, as it is while it is learned."""

    def __init__(self, folder: ShortcutWorkFolder, signature: Signature, total_steps: int) -> None:
        """Go on from what is in a folder.

        Args:
            folder: Folder to write to.
            signature: Signature of the shortcut that is learned.
            total_steps: Environment steps of all stages.
        """
        super().__init__(folder)
        self._signature = signature
        self._interval = max(1, total_steps // SNAPSHOTS)
        self._snapshots = -1  # the number of whole intervals before the last snapshot

    def after_rollout(self, learner: SavableLearner) -> None:
        """Keep the policy, the first time in each interval of environment steps."""
        steps = self._steps
        if steps // self._interval != self._snapshots:
            self._snapshots = steps // self._interval
            taken = Shortcut(self._signature, learner.policy(), learner.shortest)
            folder = self._folder.snapshot(steps)
            replace_folder(folder.parent, lambda draft: save_shortcut(draft / folder.name, taken))


def _cpu_s() -> float:
    """Processor time of this process, and of those that it started and that have ended, s."""
    return sum(os.times()[:4])
