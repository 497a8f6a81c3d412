# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node knows of the world: the episode, and a perceived state of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slap_ros.core import Domain, Task
from slap_ros.errors import EpisodeChangedError
from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.protocols import AtomsMessage, EpisodeFaultMessage, StateMessage
from slap_ros.relational import AtomSpace, State


@dataclass(frozen=True)
class Episode:
    """What stays the same from one reset to the next.

    Args:
        number: Counts the resets of the world, from 1 on.
        opened_ns: Stamp of the task, ns. With the number it identifies the episode, as a simulator
            that was started again counts from 1. It says nothing about before or after.
        domain: What the world runs.
        task: Initial state, goal and step limit.
        space: Every ground atom over the task's objects.
        grown: Folder of the shortcuts beside the announced skills; None where there is none.
    """

    number: int
    opened_ns: int
    domain: Domain
    task: Task
    space: AtomSpace
    grown: Path | None = None

    def may_have(self, message: StateMessage | AtomsMessage) -> bool:
        """Whether a state, or its atoms, may be of this episode: number, and at first the stamp.

        The initial state has the stamp of its task, by which the first states of two episodes of
        the same number are distinguished. Later states follow one another by their steps.
        """
        return message.episode == self.number and (
            message.step > 0 or stamp_ns(message.header) == self.opened_ns
        )

    def has(self, message: StateMessage) -> bool:
        """Whether the message is a state of this episode, as far as it says: of its objects."""
        names = [obj.name for obj in self.space.layout.objects]
        return self.may_have(message) and [obj.name for obj in message.objects] == names

    def is_ended_by(self, fault: EpisodeFaultMessage) -> bool:
        """Whether a fault is this episode's."""
        return fault.episode == self.number and stamp_ns(fault.header) == self.opened_ns


@dataclass(frozen=True)
class Observation:
    """A perceived state.

    Args:
        episode: The episode that it belongs to.
        step: Environment steps taken before it.
        state: The state as perceived, without the objects that are missing.
        abstract: The atoms that hold, as a mask over the episode's atom space.
        missing: Names of objects whose place is not known.
        exact: Whether perceiving the same state again would give the same.
    """

    episode: Episode
    step: int
    state: State
    abstract: int
    missing: frozenset[str] = frozenset()
    exact: bool = True

    def require_episode(self, number: int) -> None:
        """Refuse a goal that is for another episode.

        Raises:
            EpisodeChangedError: It is.
        """
        if number != self.episode.number:
            raise EpisodeChangedError(
                f"goal for episode {number}, but episode {self.episode.number} is under way"
            )
