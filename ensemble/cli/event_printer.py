# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run in lines of text, as it goes."""

from __future__ import annotations

from typing import Any

from slap_ros.cli.console import console, styled
from slap_ros.messages.events import AcquisitionEventKind, PlanEventKind, SkillEventKind
from slap_ros.messages.interfaces import ACQUISITION_EVENT, PLAN, PLAN_EVENT, SKILL_EVENT


class EventPrinter:
    """Prints one line per event of a run, on stderr."""

    def __init__(self) -> None:
        self._started = 0

    def __call__(self, type_name: str, message: Any) -> None:
        """Print a message of the run, if it is an event."""
        if type_name == PLAN:
            steps = [f"{edge.name} {edge.predicted_steps}" for edge in message.edges]
            console.print(
                f"plan {message.number}: {message.predicted_steps} steps ({', '.join(steps)})"
            )
        elif type_name == SKILL_EVENT:
            self._skill(message)
        elif type_name == PLAN_EVENT and message.kind == PlanEventKind.DIVERGED:
            console.print(styled("diverged", "yellow", f": {message.error_msg}"))
        elif type_name == PLAN_EVENT and message.kind == PlanEventKind.IMPROVED:
            console.print(styled("improved", "green", ": a shorter rest of the plan was found"))
        elif type_name == PLAN_EVENT and message.kind == PlanEventKind.FAILED:
            console.print(styled("failed", "red", f": {message.error_msg}"))
        elif type_name == ACQUISITION_EVENT:
            self._acquisition(message)

    def _acquisition(self, message: Any) -> None:
        if message.kind == AcquisitionEventKind.FINISHED:
            console.print(f"operators proposed: plan {', '.join(message.plan)}")
        elif message.kind == AcquisitionEventKind.JUDGED:
            steps = (len(message.success) - 1) * message.segment_steps
            console.print(
                f"{message.subject}: success {message.success[0]:.2f}, "
                f"{message.success[-1]:.2f} after {steps} steps"
            )
        elif message.kind == AcquisitionEventKind.VALIDATED:
            without, *with_it = (f"{length:.1f} steps" for length in message.lengths)
            console.print(f"{message.subject}: {without} → {''.join(with_it) or 'no plan'}")
        elif message.kind == AcquisitionEventKind.ACQUIRED:
            console.print(
                f"skills acquired: library {message.digest}, task progress {message.progress:.2f}"
            )

    def _skill(self, message: Any) -> None:
        if message.kind == SkillEventKind.STARTED:
            self._started = message.step
            return
        name = f"{message.skill}({', '.join(message.objects)})"
        outcome = SkillEventKind(message.kind).name.lower()
        steps = message.step - self._started
        console.print(f"{message.step:5d}  {name}: {outcome} after {steps} steps")
