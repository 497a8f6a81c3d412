# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal of ``acquire_skills``: what the trainer reports, as feedback, events and a result."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rclpy.action.server import ServerGoalHandle
from slap_msgs.action import AcquireSkills

from acquisition_node.acquisition_publisher import AcquisitionPublisher
from acquisition_node.trainer import Event, Trainer
from slap_ros.core import Domain
from slap_ros.errors import NothingLearnedError
from slap_ros.relational.pddl import write_domain
from slap_ros.skills.skill_library import SkillLibrary, load_skill_library


@dataclass
class SkillAcquisition:
    """A goal under way.

    Args:
        goal: Gets feedback.
        domain: Domain whose skills are acquired.
        trainer: Learns them.
        publisher: Publisher of events and of the library.
    """

    goal: ServerGoalHandle
    domain: Domain
    trainer: Trainer
    publisher: AcquisitionPublisher
    _feedback: AcquireSkills.Feedback = field(default_factory=AcquireSkills.Feedback, init=False)
    _acquired: Event = field(default_factory=dict, init=False)

    def run(self) -> AcquireSkills.Result:
        """Train, and announce the library; from a worker thread.

        Raises:
            NothingLearnedError: There are no skills.
            SlapError: Training failed.
        """
        self.trainer.run(self._on_event)
        if not self._acquired:  # it was stopped
            return AcquireSkills.Result()
        folder = Path(self._acquired["library"])
        library = load_skill_library(folder, self.domain)
        if not library.skills:
            reasons = "; ".join(map(str, library.refused)) or self._acquired["ended"]
            raise NothingLearnedError(f"no skill was learned: {reasons}")
        self.publisher.acquired(folder, library, self._operators(library))
        return self._result(library)

    def _operators(self, library: SkillLibrary) -> str:
        operators = tuple(skill.operator for skill in library.skills)
        domain = self.domain
        return write_domain(domain.name, domain.types, domain.predicates, operators)

    def _result(self, library: SkillLibrary) -> AcquireSkills.Result:
        about = self._acquired
        return AcquireSkills.Result(
            success=True,
            operators_pddl=self._operators(library),
            skills=[skill.operator.name for skill in library.skills],
            progress=float(about["progress"]),
            steps=int(about["steps"]),
            ended=str(about["ended"]),
            library=str(about["library"]),
            digest=library.digest,
        )

    # -- what the trainer reports ---------------------------------------------------------------

    def _on_event(self, event: Event) -> None:
        handler = getattr(self, f"_on_{event['event']}", None)
        if handler is not None:
            handler(event)

    def _on_answer(self, event: Event) -> None:
        self.publisher.answered(event)
        self._tell(phase=f"asking for {event['subject']}")

    def _on_verification(self, event: Event) -> None:
        self.publisher.verified(event)

    def _on_proposed(self, event: Event) -> None:
        self.publisher.finished(event["plan"], event["operators"])

    def _on_progress(self, event: Event) -> None:
        if event["done"] == 0:  # each step once
            self._tell(phase=event["phase"])

    def _on_rollout(self, event: Event) -> None:
        self.publisher.rolled_out(event)
        self._tell(iteration=event["iteration"], progress=float(event["progress"]))

    def _on_judged(self, event: Event) -> None:
        self.publisher.judged(event)
        learned = (len(event["success"]) - 1) * int(event["segment_steps"])
        self._tell(
            iteration=event["iteration"],
            skill=event["skill"],
            success=float(event["best"]),
            steps=self._feedback.steps + learned,
        )

    def _on_acquired(self, event: Event) -> None:
        self._acquired = event

    def _tell(self, **changed: Any) -> None:
        for name, value in changed.items():
            setattr(self._feedback, name, value)
        self.goal.publish_feedback(self._feedback)
