# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the acquisition node publishes: events, the feedback and result of a proposal, skills."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import ProposeOperators
from slap_msgs.msg import AcquisitionEvent, RewardTerm

from acquisition_node.trainer import Event
from ensemble import encode
from ensemble.interfaces import ACQUISITION_EVENTS, SKILLS
from slap_ros.acquisition.proposals.attempt_log import Entry
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.errors import SlapError, TaskCanceledError
from slap_ros.skills.skill_library import SkillLibrary


class AcquisitionPublisher:
    """Publishes acquisition events, and counts a proposal's answers."""

    def __init__(self, node: Node) -> None:
        """Publish as ``node``."""
        self._node = node
        topic = ACQUISITION_EVENTS
        self._events = node.create_publisher(topic.type, topic.name, topic.qos)
        self._libraries = node.create_publisher(SKILLS.type, SKILLS.name, SKILLS.qos)
        self._episode = 0
        self._answers = 0

    def started(self, episode: int) -> None:
        """A proposal begins, for the task of an episode."""
        self._episode, self._answers = episode, 0
        self._publish(AcquisitionEvent.STARTED)

    def entry(self, goal: ServerGoalHandle, entry: Entry) -> None:
        """A line of the attempt log: an event, and feedback of the goal; from a worker thread."""
        if entry["event"] == "failure":
            return  # it ends the proposal, and is told then
        if entry["event"] == "answer":
            self._answers += 1
            self.answered(entry)
        else:
            self.verified(entry)
        goal.publish_feedback(
            ProposeOperators.Feedback(
                attempt=self._answers,
                subject=entry.get("subject", "plan"),
                complaint="; ".join(entry["complaints"]),
            )
        )

    def answered(self, entry: Entry) -> None:
        """A model has answered."""
        self._publish(AcquisitionEvent.ANSWERED, **_judged(entry), **_answered(entry))

    def verified(self, entry: Entry) -> None:
        """The planner has judged all operators together."""
        plan = entry["plan"] or []
        self._publish(AcquisitionEvent.VERIFIED, **_judged(entry), plan=plan)

    def finished(self, plan: Sequence[str], operators: Sequence[str] = ()) -> None:
        """A proposal passed the checks."""
        self._publish(AcquisitionEvent.FINISHED, plan=list(plan), operators=list(operators))

    def failed(self, error: SlapError, subject: str = "") -> None:
        """None did, or it was canceled; or no skills came of one."""
        canceled = error.code == TaskCanceledError.code
        kind = AcquisitionEvent.CANCELED if canceled else AcquisitionEvent.FAILED
        code, message = int(error.code), str(error)
        self._publish(kind, subject=subject, error_code=code, error_msg=message)

    def rolled_out(self, event: Event) -> None:
        """A plan was carried out with the skills at hand."""
        self._publish(
            AcquisitionEvent.ROLLED_OUT,
            subject=event["failed"],
            complaints=event["reasons"],
            plan=event["plan"],
            iteration=event["iteration"],
            task=event["task"],
            progress=float(event["progress"]),
        )

    def judged(self, event: Event) -> None:
        """A skill was trained for a round."""
        self._publish(
            AcquisitionEvent.JUDGED,
            subject=event["skill"],
            iteration=event["iteration"],
            success=list(map(float, event["success"])),
            segment_steps=event["segment_steps"],
        )

    def validated(self, event: Event) -> None:
        """A shortcut was learned over the skills, and tried on validation tasks."""
        lengths = [event["before"], event["after"]]
        self._publish(
            AcquisitionEvent.VALIDATED,
            subject=event["shortcut"],
            lengths=[float(length) for length in lengths if length is not None],
            kept=event["kept"],
        )

    def acquired(self, folder: Path, library: SkillLibrary, operators: str) -> None:
        """A library is there, for everyone to take on.

        Args:
            folder: Absolute path of the library's folder.
            library: The library as it was read from the folder.
            operators: Operators as PDDL text.
        """
        progress = float(library.record["progress_on_fresh_tasks"])
        self._publish(AcquisitionEvent.ACQUIRED, digest=library.digest, progress=progress)
        self._libraries.publish(
            SKILLS.type(
                header=encode.header(self._node.get_clock().now().to_msg()),
                domain=library.domain,
                folder=str(folder),
                digest=library.digest,
                operators_pddl=operators,
            )
        )

    def result(self, proposal: Proposal, problem: AcquisitionProblem) -> ProposeOperators.Result:
        """The action's result for a proposal that passed."""
        operators, _ = proposal.to_pddl(problem)
        return ProposeOperators.Result(
            success=True,
            operators_pddl=operators,
            rewards=[
                RewardTerm(
                    operator_name=template.operator,
                    metric=term.metric.name,
                    arguments=[variable.name for variable in term.arguments],
                    weight=term.weight,
                )
                for template in proposal.rewards.values()
                for term in template.terms
            ],
            plan=list(proposal.plan or ()),
            provenance=json.dumps(asdict(proposal.provenance)),
            remarks=list(proposal.remarks),
        )

    def _publish(self, kind: int, **more: Any) -> None:
        now = self._node.get_clock().now().to_msg()
        self._events.publish(
            AcquisitionEvent(header=encode.header(now), episode=self._episode, kind=kind, **more)
        )


def _judged(entry: Entry) -> dict[str, Any]:
    return {
        "subject": entry.get("subject", "plan"),
        "error_classes": entry["errors"],
        "complaints": entry["complaints"],
        "attempts_left": entry["left"]["attempts"],
    }


def _answered(entry: Entry) -> dict[str, Any]:
    return {
        "request": entry["request"],
        "answer": entry["answer"],
        "tokens": entry["tokens"],
        "seconds": float(entry["seconds"]),
    }
