# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How operators were proposed: what was asked for, answered and complained about."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from slap_ros.messages.events import AcquisitionEventKind
from slap_ros.messages.protocols import AcquisitionEventMessage
from slap_ros.report.acquisitions import LEARNING, SKILLS

ENDS = {
    AcquisitionEventKind.FINISHED: "accepted",
    AcquisitionEventKind.FAILED: "failed",
    AcquisitionEventKind.CANCELED: "canceled",
}
OF_SKILLS = LEARNING | {AcquisitionEventKind.ACQUIRED, AcquisitionEventKind.VALIDATED}
KINDS = {int(kind): kind for kind in AcquisitionEventKind}
IN_PLAN = "all operators together"


@dataclass(frozen=True)
class RecordedExchange:
    """An answer of a model, or a verdict of the planner.

    Args:
        subject: Subject of the question.
        answer: Text of the answer; empty for a verdict.
        complaints: Errors and warnings about the answer.
        tokens: Number of tokens of question and answer together.
        seconds: Time waited for the answer, s.
    """

    subject: str
    answer: str
    complaints: tuple[str, ...]
    tokens: int
    seconds: float


@dataclass(frozen=True)
class RecordedProposal:
    """One proposal, as far as the bag tells.

    Args:
        outcome: Outcome of the proposal in a word.
        reason: Reason of a failure; empty if it did not fail.
        plan: Ground operators of the plan that was found.
        exchanges: Exchanges in order.
    """

    outcome: str
    reason: str
    plan: tuple[str, ...]
    exchanges: tuple[RecordedExchange, ...]


def recorded_proposals(
    events: Iterable[AcquisitionEventMessage],
) -> tuple[RecordedProposal, ...]:
    """The proposals that a bag's events tell of, in order."""
    found: list[RecordedProposal] = []
    open_: list[RecordedExchange] | None = None
    for event in events:
        kind = KINDS.get(event.kind)
        if kind is None:
            continue  # of another version, or damaged
        if kind == AcquisitionEventKind.STARTED:
            if open_ is not None:
                found.append(RecordedProposal("not ended", "", (), tuple(open_)))
            open_ = []
        elif kind in OF_SKILLS or (event.subject == SKILLS and open_ is None):
            continue  # the proposal was accepted before
        elif kind in ENDS:
            reason, plan = event.error_msg, tuple(event.plan)
            found.append(RecordedProposal(ENDS[kind], reason, plan, tuple(open_ or ())))
            open_ = None
        else:
            open_ = [*(open_ or ()), _exchange(kind, event)]
    if open_ is not None:
        found.append(RecordedProposal("not ended", "", (), tuple(open_)))
    return tuple(found)


def _exchange(kind: AcquisitionEventKind, event: AcquisitionEventMessage) -> RecordedExchange:
    verdict = kind == AcquisitionEventKind.VERIFIED
    return RecordedExchange(
        IN_PLAN if verdict else event.subject,
        event.answer,
        tuple(event.complaints),
        event.tokens,
        event.seconds,
    )
