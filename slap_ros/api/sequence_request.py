# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The request for a sequence of goals: which ones, and how skills are acquired for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.command_line import command_line
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.setting_changes import parse_changes

LEVEL = 0.8  # share of tasks that are solved up to which steps are counted, as in the paper


@dataclass(frozen=True)
class SequenceRequest:
    """A sequence of goals, and how skills are acquired for them.

    Args:
        acquisition: Request for the acquisitions, whose goal and library to keep do not count; its
            folders are those of the whole sequence. A goal is done at ``LEVEL`` where its changes
            do not say at which share of ``solved`` tasks.
        goals: Names of the goals, or atoms, in their order; two at least.
        scratch: Whether every goal is learned from scratch, for comparison.
        tasks: Number of tasks per goal in which all goals so far are tried after each.
        relearn: Whether earlier goals that are not done any more are learned again after each.

    Raises:
        InvalidParameterError: There are fewer than two goals, or one twice; or earlier goals are to
            be learned again from scratch.
    """

    acquisition: AcquisitionRequest
    goals: Sequence[str]
    scratch: bool = False
    tasks: int = 20
    relearn: bool = False

    def __post_init__(self) -> None:
        domain = self.acquisition.domain
        if len(self.goals) < 2:
            raise InvalidParameterError(
                f"a sequence has two goals at least; {domain.name} has "
                f"{', '.join(domain.goals) or 'none by name'}: give more with --goal"
            )
        if len(set(self.goals)) < len(self.goals):
            raise InvalidParameterError("a goal stands twice in the sequence; leave one out")
        if self.scratch and self.relearn:
            raise InvalidParameterError(
                "from scratch, no goal can lose what an earlier one needs; leave out --scratch or "
                "--relearn"
            )

    @property
    def command(self) -> str:
        """The command that acquires the same library again."""
        base = self.acquisition
        own = list(self.goals) == list(base.domain.goals)
        return command_line(
            "acquire-sequence",
            base.domain.name,
            preset=base.domain.preset,
            goal=None if own else list(self.goals),
            seed=base.seed,
            scratch=self.scratch or None,
            relearn=self.relearn or None,
            tasks=self.tasks,
            settings=base.settings,
            steps=base.steps,
            set=list(base.changes) or None,
        )

    def acquisition_of(self, goal: str, folder: Path, keep: Path | None) -> AcquisitionRequest:
        """The request for an acquisition of one goal.

        Args:
            goal: Name of the goal, or its atoms.
            folder: Folder of its library and of its training.
            keep: Folder of the library to carry on; None for no library.

        Raises:
            InvalidParameterError: The settings cannot be changed so.
        """
        return replace(
            self._until_done,
            goal=goal,
            keep=keep,
            library_folder=folder / "library",
            work_folder=folder / "training",
        )

    @property
    def solved(self) -> float:
        """The share of a goal's tasks that are solved once it is done."""
        return self._until_done.chosen_settings().solved

    @property
    def _until_done(self) -> AcquisitionRequest:
        """The request for an acquisition that ends where a goal is done."""
        base = self.acquisition
        given = parse_changes(base.changes, AcquisitionSettings)
        done = () if "solved" in given else (f"solved={LEVEL}",)
        return replace(base, changes=(*done, *base.changes))

    def folder(self, number: int) -> Path:
        """The folder of a goal.

        Args:
            number: Number of the goal, from 0.
        """
        return self.acquisition.work_folder / f"{number}-{_file_name(self.goals[number])}"

    def folder_again(self, number: int, goal: str) -> Path:
        """The folder in which an earlier goal is learned again.

        Args:
            number: Number of the goal after which it is learned again, from 0.
            goal: Name of the earlier goal, or its atoms.
        """
        return self.folder(number) / f"again-{_file_name(goal)}"

    def as_json(self) -> dict[str, Any]:
        """All that the results depend on, as JSON."""
        data: dict[str, Any] = {
            "acquisition": replace(self._until_done, goal=None, keep=None).command,
            "goals": list(self.goals),
            "scratch": self.scratch,
            "tasks": self.tasks,
        }
        return {**data, "relearn": True} if self.relearn else data


def _file_name(goal: str) -> str:
    """A goal as the name of a file: letters and digits of it, and what is between them as one."""
    words = "".join(letter if letter.isalnum() else " " for letter in goal).split()
    return "-".join(words)[:60]
