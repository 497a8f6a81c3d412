# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What happens while skills and shortcuts grow, as lines of JSON for whoever started the command.

What happens while skills are acquired is printed as :mod:`slap_ros.cli.acquisition_events` has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from slap_ros.api.growing import Grown
from slap_ros.api.growth import GrowthRound
from slap_ros.cli.console import print_json
from slap_ros.learning.grown_libraries import GrownLibraries
from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.training_callback import TrainingCallback


@dataclass(frozen=True)
class GrowthEvents:
    """Prints events on stdout.

    Args:
        printed: Whether events are printed; if not, nothing is.
    """

    printed: bool

    def on_round(self, number: int, one: GrowthRound) -> None:
        """A round is over.

        Args:
            number: Number of the round, from 0.
            one: What the round has brought.
        """
        data = {
            "round": number + 1,
            "skills": list(one.skills),
            "shortcuts": [tried.name for tried in one.tried if tried.kept],
            "progress": one.progress,
            "length_alone": one.length_alone,
            "length": one.length,
            "steps": one.steps,
        }
        self.print("round", data)

    def grown(self, folder: Path, grown: Grown) -> None:
        """The libraries of the best round are saved: the last event.

        Args:
            folder: Folder of all results.
            grown: What has grown.
        """
        best, saved = grown.rounds[grown.best], GrownLibraries(folder)
        data = {
            "library": str(saved.skills.resolve()),
            "shortcut_library": str(saved.shortcuts.resolve()),
            "rounds": len(grown.rounds),
            "best": grown.best + 1,
            "progress": best.progress,
            "length_alone": best.length_alone,
            "length": best.length,
            "steps": sum(one.steps for one in grown.rounds),
            "ended": grown.ended,
        }
        self.print("grown", data)

    def print(self, event: str, data: dict[str, Any]) -> None:
        """Print an event, if events are printed.

        Args:
            event: Name of the event.
            data: What there is to say of it, as JSON.
        """
        if self.printed:
            print_json({"event": event, **data})


class ShortcutEvents:
    """Prints what happens while shortcuts are learned, and passes it on."""

    def __init__(self, events: GrowthEvents, callback: TrainingCallback) -> None:
        """Print nothing yet.

        Args:
            events: Prints events.
            callback: Receiver of all that happens.
        """
        self._events, self._callback = events, callback
        self.on_left_out = callback.on_left_out

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._events.print("progress", {"phase": what, "done": done, "total": total})
        self._callback.on_progress(what, done, total)

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._events.print("ranked", {"candidates": [one.signature.name for one in ranked]})
        self._callback.on_ranked(ranked)

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._events.print("learning", {"shortcut": name, "steps": total_steps})
        self._callback.on_learning(name, folder, total_steps)

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        length = after if isfinite(after) else None
        data = {"shortcut": name, "before": before, "after": length, "kept": kept}
        self._events.print("validated", data)
        self._callback.on_validated(name, before, after, kept)
