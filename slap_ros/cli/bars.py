# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far something is: bars on a terminal, lines in a log."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

from slap_ros.cli.console import console

LOG_PERIOD_S = 60.0


class Bars(Progress):
    """Bars that go away when they are done; where stderr is no terminal, a line each, at times."""

    def __init__(
        self,
        *columns: ProgressColumn,
        on: Console | None = None,
        log_period_s: float = LOG_PERIOD_S,
    ) -> None:
        """Show nothing yet.

        Args:
            columns: Columns of each bar.
            on: Where they are shown; stderr if not given.
            log_period_s: Time between two lines about a bar, at least.
        """
        super().__init__(*columns, console=on or console.rich, transient=True)
        self._log_period_s = log_period_s
        self._logged_s: dict[TaskID, float] = {}  # elapsed as a line was printed

    def update(self, task_id: TaskID, **changes: Any) -> None:
        """See :meth:`rich.progress.Progress.update`."""
        super().update(task_id, **changes)
        self._log(task_id)

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        """See :meth:`rich.progress.Progress.advance`."""
        super().advance(task_id, advance)
        self._log(task_id)

    def _log(self, task_id: TaskID) -> None:
        if self.console.is_terminal:
            return
        for task in self.tasks:
            elapsed_s = task.elapsed or 0.0
            logged_s = self._logged_s.get(task_id, 0.0)
            if task.id == task_id and elapsed_s - logged_s >= self._log_period_s:
                self._logged_s[task_id] = elapsed_s
                self.console.print(_line(task))


def _line(task: Task) -> str:
    """How far a bar is, and what it says more, in words."""
    detail = task.fields.get("detail") or f"{task.completed:.0f} of {task.total or 0:.0f}"
    return f"{task.description.strip()}: {task.percentage:.0f}%, {detail}"


def counting_bars() -> Bars:
    """Bars of things that are counted as they are done."""
    return Bars(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
