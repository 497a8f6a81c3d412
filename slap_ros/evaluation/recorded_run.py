# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The record of a run: its events, its plans, and the messages of its episode."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.evaluation.run_events import RunEvents
from slap_ros.messages.events import ANNOUNCING
from slap_ros.messages.protocols import PlanEventMessage, PlanMessage, TaskMessage


@dataclass
class EpisodeLog:
    """The record of an episode, events left out; one episode may have several runs.

    Args:
        task: Newest task of the episode; None where it is missing.
        steps: Environment steps of the states that were recorded.
        atoms: Perceived atoms, by environment step.
        plans: Plans in the order in which they were made.
    """

    task: TaskMessage | None = None
    steps: set[int] = field(default_factory=set)
    atoms: dict[int, AtomNames] = field(default_factory=dict)
    plans: list[PlanMessage] = field(default_factory=list)


@dataclass(frozen=True)
class RecordedRun:
    """A run as far as it was recorded.

    Args:
        domain: Name of the domain; empty where it is not known.
        preset: Preset of the domain; None where it is not known.
        events: Plan events of the run.
        episode: Record of the run's episode, of which the run may be a part.
        announced: Plan that each event of the run announced that announces one; None where it is
            missing.
    """

    domain: str
    preset: str | None
    events: RunEvents
    episode: EpisodeLog
    announced: Sequence[PlanMessage | None]

    @property
    def first_step(self) -> int:
        """The environment step of the run's first event."""
        return self.events.start.step

    @property
    def last_step(self) -> int:
        """The environment step of the last event, or of the last state if the run goes on."""
        if self.events.end is not None:
            return self.events.end.step
        return max(self.events.messages[-1].step, *self.episode.steps, self.first_step)

    @property
    def plans(self) -> list[PlanMessage]:
        """The plans made in the run, in order, without those that are missing."""
        return [plan for plan in self.announced if plan is not None]

    @property
    def goal(self) -> AtomNames | None:
        """The atoms that the run was to reach: the goal of its plans, or else the task's own."""
        for plan in reversed(self.plans):
            if len(plan.goal):
                return atom_names(plan.goal)
        task = self.episode.task
        return atom_names(task.goal) if task is not None else None

    def spans(self, episode: int, step: int) -> bool:
        """Whether a step of an episode is a step of this run."""
        return self.events.episode == episode and self.first_step <= step <= self.last_step


def announced_plans(
    events: Iterable[PlanEventMessage], plans: Iterable[PlanMessage]
) -> dict[int, PlanMessage]:
    """The plans that the events of an episode announced, without those that are missing.

    By number and order, not by stamps: clocks are set back, and each run counts from 0.

    Args:
        events: Plan events of the episode, all of them in order.
        plans: Plans of the episode, all of them in order.

    Returns:
        By the ``id`` of the event, since messages have no hash.
    """
    found: dict[int, PlanMessage] = {}
    waiting = list(plans)
    for event in (one for one in events if one.kind in ANNOUNCING):
        numbers = [plan.number for plan in waiting]
        if event.plan_number in numbers:
            position = numbers.index(event.plan_number)
            found[id(event)] = waiting[position]
            del waiting[: position + 1]
    return found
