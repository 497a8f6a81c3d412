# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was executed when: a span for each option, and where plans broke."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slap_ros.evaluation.metrics import SHORTCUT, OptionMetrics
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.messages.events import PlanEventKind
from slap_ros.messages.protocols import PlanEdgeMessage, PlanEventMessage


@dataclass(frozen=True)
class OptionSpan:
    """An option as it was executed; steps count from the run's start."""

    number: int  # from 1
    option: OptionMetrics
    start: int  # step
    predicted_steps: int | None  # None: no plan asked for it

    @property
    def end(self) -> int:
        """The step at which the option ended."""
        return self.start + self.option.steps

    @property
    def text(self) -> str:
        """The option with its objects."""
        return call(self.option.name, self.option.objects)

    @property
    def is_shortcut(self) -> bool:
        """Whether the option was learned."""
        return self.option.kind == SHORTCUT


@dataclass(frozen=True)
class Incident:
    """Where a plan could not go on, or the run was given up."""

    step: int  # from the run's start
    kind: str  # diverged or failed
    reason: str


def call(name: str, objects: tuple[str, ...]) -> str:
    """A predicate or option with its objects."""
    return f"{name}({', '.join(objects)})"


def spans(trace: RunTrace) -> tuple[OptionSpan, ...]:
    """The options of a run in the order in which they began."""
    planned = list(_begun_edges(trace))
    found = []
    for number, (option, start) in enumerate(
        zip(trace.metrics.options, trace.starts, strict=True), start=1
    ):
        key = (start, option.name, option.objects)
        at = next((i for i, (step, edge) in enumerate(planned) if key == _key(step, edge)), None)
        predicted = planned.pop(at)[1].predicted_steps if at is not None else None
        found.append(OptionSpan(number, option, start - trace.first_step, predicted))
    return tuple(found)


def incidents(trace: RunTrace) -> tuple[Incident, ...]:
    """What went otherwise than planned, in order."""
    kinds = {PlanEventKind.DIVERGED: "diverged", PlanEventKind.FAILED: "failed"}
    return tuple(
        Incident(event.step - trace.first_step, kinds[PlanEventKind(event.kind)], event.error_msg)
        for event in trace.events
        if event.kind in kinds
    )


def edge_of(trace: RunTrace, event: PlanEventMessage) -> PlanEdgeMessage | None:
    """The edge that an event is about; None where its plan was not recorded."""
    for plan in trace.plans:
        if plan.number == event.plan_number and event.edge < len(plan.edges):
            return plan.edges[event.edge]
    return None


def _begun_edges(trace: RunTrace) -> Iterator[tuple[int, PlanEdgeMessage]]:
    for event in trace.events:
        edge = edge_of(trace, event) if event.kind == PlanEventKind.EDGE_STARTED else None
        if edge is not None:
            yield event.step, edge


def _key(step: int, edge: PlanEdgeMessage) -> tuple[int, str, tuple[str, ...]]:
    return step, edge.name, tuple(edge.objects)
