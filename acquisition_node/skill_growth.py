# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal of ``grow_skills``: what the trainer reports of rounds and of shortcuts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slap_msgs.action import GrowSkills

from acquisition_node.trainer import Event
from acquisition_node.trainer_goal import TrainerGoal
from slap_ros.shortcuts.shortcut_library import load_library


class SkillGrowth(TrainerGoal):
    """Skills and shortcuts over them, under way."""

    kind = GrowSkills
    command = "grow"
    last = "grown"
    place = "in"

    def more(self) -> dict[str, Any]:
        """The shortcuts of the best round, and how long plans are with them."""
        about = self.told
        library = load_library(Path(about["shortcut_library"]), self.domain)
        return {
            "shortcuts": [shortcut.name for shortcut in library.shortcuts],
            "shortcut_library": str(about["shortcut_library"]),
            "shortcut_digest": library.digest,
            "length_alone": float(about["length_alone"]),
            "length": float(about["length"]),
            "rounds": int(about["rounds"]),
            "best_round": int(about["best"]),
        }

    def _on_proposed(self, event: Event) -> None:
        """A round begins with its operators."""
        super()._on_proposed(event)
        self.tell(round=self._finished + 1)

    def _on_learning(self, event: Event) -> None:
        self.tell(phase=f"learning {event['shortcut']}", shortcut=event["shortcut"])

    def _on_validated(self, event: Event) -> None:
        self.publisher.validated(event)
        self.tell(shortcut=event["shortcut"])

    def _on_round(self, event: Event) -> None:
        self._finished, self._steps = int(event["round"]), self._steps + int(event["steps"])
        self.tell(
            steps=self._steps,
            length_alone=float(event["length_alone"]),
            length=float(event["length"]),
        )

    _finished = 0  # rounds
    _steps = 0  # environment steps of these rounds
