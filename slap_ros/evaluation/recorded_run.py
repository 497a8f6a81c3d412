# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All that was recorded of a run: its events, its plans, and the messages of its episode."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.evaluation.run_events import RunEvents
from slap_ros.messages.events import PlanEventKind
from slap_ros.messages.protocols import PlanEventMessage, PlanMessage, TaskMessage


@dataclass
class EpisodeLog:
    """What was recorded of an episode, events left out; one episode may have several runs.

    Args:
        task: The newest; None where it is missing.
        steps: Of the states.
        atoms: Perceived atoms, by step.
        plans: In the order in which they were made.
    """

    task: TaskMessage | None = None
    steps: set[int] = field(default_factory=set)
    atoms: dict[int, AtomNames] = field(default_factory=dict)
    plans: list[PlanMessage] = field(default_factory=list)


@dataclass(frozen=True)
class RecordedRun:
    """A run as far as it was recorded.

    Args:
        domain: The domain's name; empty where it is not known.
        preset: Of the domain; None where it is not known.
        events: Its plan events.
        episode: The messages of its episode, of which it may be a part.
        announced: The plan that each of its PLANNED events announced; None where it is missing.
    """

    domain: str
    preset: str | None
    events: RunEvents
    episode: EpisodeLog
    announced: Sequence[PlanMessage | None]

    @property
    def first_step(self) -> int:
        """The step of its first event."""
        return self.events.start.step

    @property
    def last_step(self) -> int:
        """The step of its last event, or of the last state where it has not ended."""
        if self.events.end is not None:
            return self.events.end.step
        return max(self.events.messages[-1].step, *self.episode.steps, self.first_step)

    @property
    def plans(self) -> list[PlanMessage]:
        """The plans made in it, in order, as far as they are here."""
        return [plan for plan in self.announced if plan is not None]

    @property
    def goal(self) -> AtomNames | None:
        """What it was to reach: the goal of its plans, or else the task's own."""
        for plan in reversed(self.plans):
            if len(plan.goal):
                return atom_names(plan.goal)
        task = self.episode.task
        return atom_names(task.goal) if task is not None else None

    def spans(self, episode: int, step: int) -> bool:
        """Whether a step of an episode is one of its steps."""
        return self.events.episode == episode and self.first_step <= step <= self.last_step


def announced_plans(
    events: Iterable[PlanEventMessage], plans: Iterable[PlanMessage]
) -> dict[int, PlanMessage]:
    """The plans that the PLANNED events of an episode announced, as far as they are here.

    By number and order, not by stamps: clocks are set back, and each run counts from 0.

    Args:
        events: All plan events of the episode, in order.
        plans: All its plans, in order.

    Returns:
        By the ``id`` of the event, since messages have no hash.
    """
    found: dict[int, PlanMessage] = {}
    waiting = list(plans)
    for event in (one for one in events if one.kind == PlanEventKind.PLANNED):
        numbers = [plan.number for plan in waiting]
        if event.plan_number in numbers:
            position = numbers.index(event.plan_number)
            found[id(event)] = waiting[position]
            del waiting[: position + 1]
    return found
