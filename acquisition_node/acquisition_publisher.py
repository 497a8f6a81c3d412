# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the acquisition node tells of a proposal: events, feedback, and the result."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import ProposeOperators
from slap_msgs.msg import AcquisitionEvent, RewardTerm

from ensemble import encode
from ensemble.interfaces import ACQUISITION_EVENTS
from slap_ros.acquisition.attempt_log import Entry
from slap_ros.acquisition.problem import AcquisitionProblem
from slap_ros.acquisition.proposal import Proposal
from slap_ros.errors import SlapError, TaskCanceledError


class AcquisitionPublisher:
    """Publishes acquisition events, and counts a proposal's answers."""

    def __init__(self, node: Node) -> None:
        """Publish as ``node``."""
        self._node = node
        topic = ACQUISITION_EVENTS
        self._events = node.create_publisher(topic.type, topic.name, topic.qos)
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
            self._publish(AcquisitionEvent.ANSWERED, **_judged(entry), **_answered(entry))
        else:
            plan = entry["plan"] or []
            self._publish(AcquisitionEvent.VERIFIED, **_judged(entry), plan=plan)
        goal.publish_feedback(
            ProposeOperators.Feedback(
                attempt=self._answers,
                subject=entry.get("subject", "plan"),
                complaint="; ".join(entry["complaints"]),
            )
        )

    def finished(self, plan: Sequence[str]) -> None:
        """A proposal passed the checks."""
        self._publish(AcquisitionEvent.FINISHED, plan=list(plan))

    def failed(self, error: SlapError) -> None:
        """None did, or it was canceled."""
        canceled = error.code == TaskCanceledError.code
        kind = AcquisitionEvent.CANCELED if canceled else AcquisitionEvent.FAILED
        self._publish(kind, error_code=int(error.code), error_msg=str(error))

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
