# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plan events of runs.

A run begins with an episode's first PLANNING_STARTED, or with the first after a run has ended, and
ends with SOLVED or FAILED.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.events import ANNOUNCING, PlanEventKind
from slap_ros.messages.protocols import PlanEventMessage

RUN_ENDS = (PlanEventKind.SOLVED, PlanEventKind.FAILED)
PLANNING_ENDS = (PlanEventKind.PLANNED, PlanEventKind.FAILED)
COUNTING = (*ANNOUNCING, PlanEventKind.FAILED)  # which say how many options were simulated


@dataclass(frozen=True)
class RunEvents:
    """The plan events of one run, in order."""

    messages: Sequence[PlanEventMessage]

    @property
    def start(self) -> PlanEventMessage:
        """The event that began the run."""
        return self.messages[0]

    @property
    def episode(self) -> int:
        """The number of the run's episode."""
        return self.start.episode

    @property
    def end(self) -> PlanEventMessage | None:
        """The event that ended the run; None where the run goes on, or breaks off."""
        return self.messages[-1] if self.messages[-1].kind in RUN_ENDS else None

    @property
    def planned(self) -> list[PlanEventMessage]:
        """The events that announce a plan, in order."""
        return [event for event in self.messages if event.kind in ANNOUNCING]

    def planning_ns(self) -> int:
        """The planning time of all plans together, ns."""
        total, started = 0, None
        for event in self.messages:
            if event.kind == PlanEventKind.PLANNING_STARTED:
                started = stamp_ns(event.header)
            elif event.kind in PLANNING_ENDS and started is not None:
                total += stamp_ns(event.header) - started
                started = None
        return total

    def count(self, kind: PlanEventKind) -> int:
        """The number of events of a kind."""
        return sum(event.kind == kind for event in self.messages)

    def edges_begun(self) -> Counter[int]:
        """The number of edges of plans that began at each environment step."""
        started = (event for event in self.messages if event.kind == PlanEventKind.EDGE_STARTED)
        return Counter(event.step for event in started)

    def edges_rolled_out(self) -> int:
        """The number of options that were simulated for all plans."""
        return sum(event.edges_rolled_out for event in self.messages if event.kind in COUNTING)


def split_into_runs(events: Iterable[PlanEventMessage]) -> list[RunEvents]:
    """Split plan events into runs. Events before the first start belong to no run."""
    runs: list[list[PlanEventMessage]] = []
    under_way = False
    for event in events:
        if under_way and event.episode != runs[-1][0].episode:
            under_way = False  # the simulator was reset in the middle of a run
        if not under_way:
            if event.kind != PlanEventKind.PLANNING_STARTED:
                continue
            runs.append([])
            under_way = True
        runs[-1].append(event)
        under_way = event.kind not in RUN_ENDS
    return [RunEvents(run) for run in runs]


def count_without_start(events: Iterable[PlanEventMessage]) -> int:
    """The number of plan events that precede the start of the run that they belong to."""
    count, under_way, episode = 0, False, None
    for event in events:
        under_way = event.kind == PlanEventKind.PLANNING_STARTED or (
            under_way and event.episode == episode
        )
        count += not under_way
        episode = event.episode
        under_way = under_way and event.kind not in RUN_ENDS
    return count
