# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run's metrics with the messages that tell when what happened in it, for reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from slap_ros.evaluation.atom_names import AtomNames
from slap_ros.evaluation.executed_options import ExecutedOption
from slap_ros.evaluation.measurement import measure
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.recorded_run import RecordedRun
from slap_ros.messages.protocols import PlanEventMessage, PlanMessage


@dataclass(frozen=True)
class RunTrace:
    """A run together with the messages that tell when what happened in it."""

    metrics: RunMetrics
    episode: int
    first_step: int
    last_step: int
    starts: tuple[int, ...]  # the step at which each of the metrics' options began
    goal: AtomNames | None  # None: neither a plan nor the task is known
    plans: tuple[PlanMessage, ...]  # in order
    events: tuple[PlanEventMessage, ...]  # in order

    @classmethod
    def of(cls, run: RecordedRun, options: Sequence[ExecutedOption]) -> RunTrace:
        """The trace of a run.

        Args:
            run: What was recorded of it.
            options: That were executed in it, in order.
        """
        return cls(
            metrics=measure(run, options),
            episode=run.events.episode,
            first_step=run.first_step,
            last_step=run.last_step,
            starts=tuple(option.start.step for option in options),
            goal=run.goal,
            plans=tuple(run.plans),
            events=tuple(run.events.messages),
        )
