# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a training has kept in its work folder (``slap train --work``), read by studies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text
from slap_ros.learning.json_lines import decoded_lines
from slap_ros.learning.success_curve import by_stage
from slap_ros.learning.work_folder import DECODING_ERRORS, damaged
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary, load_shortcut
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

ADVICE = "give another work folder, or train again"  # where a file is damaged


@dataclass(frozen=True)
class LearningPoint:
    """How learning stood at one time; success and length are over recent episodes, with noise."""

    steps: int  # environment steps of all stages so far
    success: float  # between 0 and 1
    length: float | None  # environment steps of successful episodes; None where there is none


@dataclass(frozen=True)
class LearningCurve:
    """How one shortcut was learned.

    Args:
        shortcut: Name of the shortcut.
        points: Points of the curve, in the order of their steps.
        stages: Environment steps at which each stage but the first begins.
    """

    shortcut: str
    points: tuple[LearningPoint, ...]
    stages: tuple[int, ...]


@dataclass(frozen=True)
class TrainingFolder:
    """The work folder of a training, done or under way."""

    path: Path

    def require_domain(self, domain: str) -> None:
        """Refuse the training of another domain.

        Raises:
            InvalidParameterError: It is one, or no training at all.
        """
        trained = self._setting("place")["domain"]
        if trained != domain:
            raise InvalidParameterError(
                f"{self.path} has a training of domain {trained!r}, not of {domain!r}"
            )

    def distribution(self) -> dict[str, Any]:
        """Domain, preset and seed.

        Raises:
            InvalidParameterError: The folder has no training, or a damaged one.
        """
        return dict(self._setting("place"))

    def exploration(self) -> ExplorationSettings:
        """How candidates were found.

        Raises:
            InvalidParameterError: The folder has no training, or a damaged one.
        """
        settings = self._setting("exploration")
        try:
            return ExplorationSettings.from_json(settings)
        except DECODING_ERRORS as error:
            raise _damaged(self.path / "settings.json", error) from error

    def explored(self) -> tuple[ExplorationResult, ...]:
        """What exploring came to, a task each.

        Raises:
            InvalidParameterError: Exploring is not over, or the file is damaged.
        """
        path = self.path / "explored.json"
        tasks = _read(path)
        try:
            return tuple(ExplorationResult.from_json(task) for task in tasks)
        except DECODING_ERRORS as error:
            raise _damaged(path, error) from error

    def curves(self) -> tuple[LearningCurve, ...]:
        """The curves of all shortcuts that were, or are being, learned; by name.

        Raises:
            InvalidParameterError: There are none, or a file is damaged.
        """
        paths = sorted(self.path.glob("*/progress.jsonl"))
        if not paths:
            raise InvalidParameterError(
                f"{self.path}: no training that has begun to learn: no progress.jsonl in a folder "
                "in it; give the work folder of `slap train`"
            )
        return tuple(read_curve(path) for path in paths)

    def while_learned(self, shortcut: Shortcut) -> tuple[tuple[int, Shortcut], ...] | None:
        """How a shortcut was in the course of the attempt that came to it.

        Args:
            shortcut: Shortcut of a library.

        Returns:
            Environment steps and the shortcut as it was then, and itself in the end; None where
            none of the attempts came to it.

        Raises:
            InvalidLibraryError: A snapshot is damaged.
        """
        for done in sorted(self.path.glob(f"**/{shortcut.name}/finished")):
            work = ShortcutWorkFolder(done.parent)
            learned = load_shortcut(work.shortcut)
            if _digest(learned) == _digest(shortcut):
                total = int(learned.record["environment_steps"])
                before = [steps for steps in work.snapshots if steps < total]
                return (
                    *((steps, load_shortcut(work.snapshot(steps))) for steps in before),
                    (total, shortcut),
                )
        return None

    def _setting(self, name: str) -> Mapping[str, Any]:
        path = self.path / "settings.json"
        settings = _read(path)
        if not isinstance(settings, dict) or not isinstance(settings.get(name), dict):
            raise _damaged(path, f"no {name} in it")
        return dict(settings[name])


def described(folders: Sequence[TrainingFolder]) -> dict[str, Any]:
    """What reports say of trainings: domain, preset and seed of each."""
    return {"trainings": [folder.distribution() for folder in folders]}


def _digest(shortcut: Shortcut) -> str:
    return ShortcutLibrary("", (shortcut,)).digest


def read_curve(path: Path) -> LearningCurve:
    """The curve in a progress file: a JSON object a line, as training appends them.

    Stages are put one after the other. A training that was interrupted went on from a checkpoint:
    what it did twice counts the second time. A last line that was not written out is left out.

    Raises:
        InvalidParameterError: A line is damaged, or there is none; names file and line.
    """
    stages = by_stage(decoded_lines(path, _point, ADVICE))
    if not stages:
        raise InvalidParameterError(f"{path}: nothing learned so far; try again later")
    joined: list[LearningPoint] = []
    begins: list[int] = []
    for own in stages.values():
        before = joined[-1].steps if joined else 0
        begins.append(before)
        joined += [LearningPoint(before + p.steps, p.success, p.length) for p in own]
    return LearningCurve(path.parent.name, tuple(joined), tuple(begins[1:]))


def _point(line: Mapping[str, Any]) -> tuple[int, LearningPoint]:
    """Stage, and point with the steps of that stage.

    Raises:
        LookupError, TypeError, ValueError, OverflowError: The line has no such figures.
    """
    length = None if line["length"] is None else float(line["length"])
    point = LearningPoint(int(line["steps"]), float(line["success"]), length)
    numbers = [point.success, *([] if length is None else [length])]
    if not all(map(math.isfinite, numbers)) or not 0.0 <= point.success <= 1.0 or point.steps < 0:
        raise ValueError(f"success {point.success}, length {length}, steps {point.steps}")
    return int(line["stage"]), point


def _read(path: Path) -> Any:
    try:
        return parse_json(read_text(path))
    except OSError as error:
        raise InvalidParameterError(
            f"{path}: cannot be read: {error.strerror}; give the work folder of `slap train`"
        ) from error
    except ValueError as error:
        raise _damaged(path, error) from error


def _damaged(where: Path | str, what: Exception | str) -> InvalidParameterError:
    return damaged(where, what, ADVICE)
