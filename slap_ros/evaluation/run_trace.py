# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run's metrics with the messages that say what happened when, for reports."""

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
    """The metrics of a run with the messages that say what happened when."""

    metrics: RunMetrics
    episode: int
    first_step: int
    last_step: int
    starts: tuple[int, ...]  # the step at which each of the metrics' options began
    goal: AtomNames | None  # atoms to reach; None: neither a plan nor the task is known
    plans: tuple[PlanMessage, ...]  # plans of the run, in order
    events: tuple[PlanEventMessage, ...]  # plan events of the run, in order

    @classmethod
    def of(cls, run: RecordedRun, options: Sequence[ExecutedOption]) -> RunTrace:
        """The trace of a run.

        Args:
            run: Record of the run.
            options: Options that were executed in the run, in order.
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
