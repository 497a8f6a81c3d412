# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options as they were executed, from skill events, and the runs that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from slap_ros.evaluation.recorded_run import RecordedRun
from slap_ros.messages.events import SkillEventKind
from slap_ros.messages.protocols import SkillEventMessage

OUTCOMES: Mapping[int, str] = {
    SkillEventKind.REACHED: "reached",
    SkillEventKind.FAILED: "failed",
    SkillEventKind.CANCELED: "canceled",
}
UNFINISHED = "unfinished"


@dataclass
class ExecutedOption:
    """An option from its STARTED on; the event that ended it follows, if it was recorded."""

    start: SkillEventMessage
    end: SkillEventMessage | None = None

    @property
    def outcome(self) -> str:
        """How the option ended: reached, failed, canceled or unfinished."""
        return OUTCOMES[self.end.kind] if self.end is not None else UNFINISHED

    @property
    def reached(self) -> bool:
        """Whether the option has reached its target."""
        return self.end is not None and self.end.kind == SkillEventKind.REACHED


def executed_options(events: Iterable[SkillEventMessage]) -> list[ExecutedOption]:
    """Each option's STARTED with the event that ended it, in the order of their starts."""
    options: list[ExecutedOption] = []
    under_way: dict[tuple[int, str, tuple[str, ...]], ExecutedOption] = {}
    for event in events:
        key = (event.episode, event.skill, tuple(event.objects))
        if event.kind == SkillEventKind.STARTED:
            options.append(ExecutedOption(event))
            under_way[key] = options[-1]
        elif event.kind in OUTCOMES and key in under_way:
            under_way.pop(key).end = event
    return options


def options_by_run(
    options: Iterable[ExecutedOption], runs: Sequence[RecordedRun]
) -> list[list[ExecutedOption]]:
    """The options of each run, in order; one that was requested by hand may belong to none.

    One run may end at the step at which the next begins. Each has as many options that begin
    there as it began edges.
    """
    begun = [run.events.edges_begun() for run in runs]
    found: list[list[ExecutedOption]] = [[] for _ in runs]
    for option in options:
        step = option.start.step
        fitting = [i for i, run in enumerate(runs) if run.spans(option.start.episode, step)]
        if fitting:
            chosen = next((i for i in fitting if begun[i][step] > 0), fitting[-1])
            begun[chosen][step] -= 1
            found[chosen].append(option)
    return found
