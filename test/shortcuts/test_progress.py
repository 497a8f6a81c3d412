# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The figures of a training that was interrupted are those of all of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from slap_ros.shortcuts.progress import Progress, ProgressRecorder
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

FIRST = Progress(steps=10, episodes=2, success=0.5, length=4.0, failure=0.0, shortest=4)


def lines(folder: ShortcutWorkFolder) -> list[dict[str, Any]]:
    return [json.loads(line) for line in folder.progress.read_text().splitlines()]


def test_processor_time_goes_on_where_an_interrupted_process_was(tmp_path: Path) -> None:
    folder = ShortcutWorkFolder(tmp_path)
    ProgressRecorder(folder).of(0, None)(FIRST)  # type: ignore[arg-type]
    (line,) = lines(folder)
    folder.progress.write_text(json.dumps(line | {"cpu_s": 1000.0}) + "\n")
    again = ProgressRecorder(folder)
    again.of(1, None)(FIRST)  # type: ignore[arg-type]
    assert 1000.0 <= lines(folder)[1]["cpu_s"] <= again.record()["cpu_s"] < 2000.0
    record = again.record()
    assert record["environment_steps"] == 20
    assert record["success_curve"] == [[10, 0.5], [20, 0.5]]


def test_progress_of_earlier_versions_has_no_processor_time(tmp_path: Path) -> None:
    folder = ShortcutWorkFolder(tmp_path)
    ProgressRecorder(folder).of(0, None)(FIRST)  # type: ignore[arg-type]
    (line,) = lines(folder)
    del line["cpu_s"]
    folder.progress.write_text(json.dumps(line) + "\n")
    assert 0.0 <= ProgressRecorder(folder).record()["cpu_s"] < 1000.0
