# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A goal that a trainer works for: what it reports of skills, as feedback and events."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from rclpy.action.server import ServerGoalHandle

from acquisition_node.acquisition_publisher import AcquisitionPublisher
from acquisition_node.trainer import Event, Trainer
from slap_ros.core import Domain
from slap_ros.errors import NothingLearnedError
from slap_ros.relational.pddl import write_domain
from slap_ros.skills.skill_library import SkillLibrary, load_skill_library


class TrainerGoal(ABC):
    """A goal under way. An event of the name NAME goes to the method ``_on_NAME``, if there is one.

    Attributes:
        kind: Type of the action.
        command: Command of slap that the trainer runs.
        last: Name of the trainer's last event, which says where the results are.
        place: Where the trainer keeps what is under way, by its folder: beside it or in it.
    """

    kind: Any
    command: str
    last: str
    place: str

    def __init__(
        self,
        goal: ServerGoalHandle,
        domain: Domain,
        trainer: Trainer,
        publisher: AcquisitionPublisher,
    ) -> None:
        """Run nothing yet.

        Args:
            goal: Goal that gets feedback.
            domain: Domain whose skills are acquired.
            trainer: Learns them.
            publisher: Publisher of events and of the library.
        """
        self.goal, self.domain, self.trainer, self.publisher = goal, domain, trainer, publisher
        self.feedback = self.kind.Feedback()
        self.told: Event = {}  # the trainer's last event

    def run(self) -> Any:
        """Train, and announce the library of skills; from a worker thread.

        Returns:
            The result of the goal's action.

        Raises:
            NothingLearnedError: There are no skills.
            SlapError: Training failed.
        """
        self.trainer.run(self._on_event)
        if not self.told:  # it was stopped
            return self.kind.Result()
        folder = Path(self.told["library"])
        library = load_skill_library(folder, self.domain)
        if not library.skills:
            reasons = "; ".join(map(str, library.refused)) or self.told["ended"]
            raise NothingLearnedError(f"no skill was learned: {reasons}")
        operators = self._operators(library)
        self.publisher.acquired(folder, library, operators)
        return self.kind.Result(
            success=True,
            operators_pddl=operators,
            skills=[skill.operator.name for skill in library.skills],
            progress=float(self.told["progress"]),
            steps=int(self.told["steps"]),
            ended=str(self.told["ended"]),
            library=str(folder),
            digest=library.digest,
            **self.more(),
        )

    @abstractmethod
    def more(self) -> dict[str, Any]:
        """What the result says beside what it says of skills, by field."""

    def _operators(self, library: SkillLibrary) -> str:
        operators = tuple(skill.operator for skill in library.skills)
        domain = self.domain
        return write_domain(domain.name, domain.types, domain.predicates, operators)

    # -- what the trainer reports ---------------------------------------------------------------

    def _on_event(self, event: Event) -> None:
        if event["event"] == self.last:
            self.told = event
        handler = getattr(self, f"_on_{event['event']}", None)
        if handler is not None:
            handler(event)

    def _on_answer(self, event: Event) -> None:
        self.publisher.answered(event)
        self.tell(phase=f"asking for {event['subject']}")

    def _on_verification(self, event: Event) -> None:
        self.publisher.verified(event)

    def _on_proposed(self, event: Event) -> None:
        self.publisher.finished(event["plan"], event["operators"])

    def _on_progress(self, event: Event) -> None:
        if event["done"] == 0:  # each step once
            self.tell(phase=event["phase"])

    def _on_rollout(self, event: Event) -> None:
        self.publisher.rolled_out(event)
        self.tell(iteration=event["iteration"], progress=float(event["progress"]))

    def _on_judged(self, event: Event) -> None:
        self.publisher.judged(event)
        learned = (len(event["success"]) - 1) * int(event["segment_steps"])
        self.tell(
            iteration=event["iteration"],
            skill=event["skill"],
            success=float(event["best"]),
            steps=self.feedback.steps + learned,
        )

    def tell(self, **changed: Any) -> None:
        """Publish feedback in which some fields have changed.

        Args:
            changed: Values of the fields that have changed.
        """
        for name, value in changed.items():
            setattr(self.feedback, name, value)
        self.goal.publish_feedback(self.feedback)
