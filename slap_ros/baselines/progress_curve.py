# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Task progress over environment steps while a whole task is learned (LG-SAIL Fig. 4)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from slap_ros.files import parse_json, read_text, write_whole
from slap_ros.learning.work_folder import DECODING_ERRORS, damaged

CURVE = "curve.json"
TIMES = 10  # measurements of a training, beside the one before it


class ProgressCurve:
    """Measures now and then, and keeps the points in a file, so that a training can go on.

    Args:
        folder: Work folder of the training.
        measure: Function that gives the task progress of the policy as it is now, from 0 to 1.
        total_steps: Environment steps of the whole training.
    """

    def __init__(self, folder: Path, measure: Callable[[], float], total_steps: int) -> None:
        self._file, self._measure = folder / CURVE, measure
        self._every = max(1, total_steps // TIMES)
        self.points: list[tuple[int, float]] = []

    def go_on(self, steps: int) -> None:
        """Take back what was measured before, and measure where nothing was.

        Args:
            steps: Environment steps so far; what was measured later is measured again.

        Raises:
            InvalidParameterError: The file is damaged.
        """
        if self._file.exists():
            self.points = [point for point in self._read() if point[0] <= steps]
        if not self.points:
            self._add(steps)

    def advance(self, steps: int) -> None:
        """Measure if it is time.

        Args:
            steps: Environment steps so far.
        """
        if steps // self._every > self.points[-1][0] // self._every:
            self._add(steps)

    def _add(self, steps: int) -> None:
        self.points.append((steps, self._measure()))
        write_whole(self._file, json.dumps(self.points))

    def _read(self) -> list[tuple[int, float]]:
        try:
            points = parse_json(read_text(self._file))
            return [(int(steps), float(progress)) for steps, progress in points]
        except DECODING_ERRORS as error:
            advice = "remove the folder to train from the beginning"
            raise damaged(self._file, type(error).__name__, advice) from error
