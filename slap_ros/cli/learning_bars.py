# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is shown while something is learned in other processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from threading import Event, Thread
from typing import Self

from rich.progress import ProgressColumn, TaskID, TextColumn

from slap_ros.cli.bars import Bars
from slap_ros.cli.console import console

REFRESH_S = 1.0


class LearningBars:
    """A bar per step and per thing being learned; what is learned is followed by its files."""

    def __init__(self, bar: ProgressColumn, *after: ProgressColumn) -> None:
        """Show nothing yet.

        Args:
            bar: What the bar itself looks like.
            after: What stands behind the text in which a bar says more, its field ``detail``.
        """
        self._columns = (
            TextColumn("{task.description}", markup=False),
            bar,
            TextColumn("{task.fields[detail]}", markup=False),
            *after,
        )
        self._counting: dict[str, TaskID] = {}
        self._following: tuple[Event, Thread] | None = None

    @cached_property
    def bars(self) -> Bars:
        """The bars on the screen, from the first one on: a refusal has none around it."""
        bars = Bars(*self._columns)
        bars.start()
        return bars

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.unfollow()
        if "bars" not in vars(self):
            return
        self.bars.stop()
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            console.print("what was done is kept: the same command goes on")

    def on_progress(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done.

        Args:
            what: The step, in words.
            done: Jobs done so far; 0 as the step begins.
            total: Jobs of the step.
        """
        if what not in self._counting:
            self._counting[what] = self.bars.add_task(what, total=total, detail="")
        self.bars.update(self._counting[what], completed=done, detail=f"{done} of {total}")
        if done == total:
            self.bars.remove_task(self._counting.pop(what))

    def follow(self, show: Callable[[], None], bars: Sequence[TaskID]) -> None:
        """Show something again and again, in a thread, instead of what was shown before.

        Args:
            show: Reads how far it is, and updates its bars.
            bars: Those, which are removed in the end.
        """
        self.unfollow()
        stop = Event()
        thread = Thread(target=self._show, args=(show, bars, stop), daemon=True)
        self._following = stop, thread
        thread.start()

    def unfollow(self) -> None:
        """Show it no more."""
        if self._following is not None:
            stop, thread = self._following
            stop.set()
            thread.join()
            self._following = None

    def _show(self, show: Callable[[], None], bars: Sequence[TaskID], stop: Event) -> None:
        show()
        while not stop.wait(REFRESH_S):
            show()
        for bar in bars:
            self.bars.remove_task(bar)
