# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A proposal, made in a thread: whoever is asked may take minutes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from acquisition_node.inquiry_parameters import InquiryParameters
from slap_ros.acquisition.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.induction import InducedProposer
from slap_ros.acquisition.language_proposer import LanguageProposer, LanguageRewarder
from slap_ros.acquisition.problem import AcquisitionProblem
from slap_ros.acquisition.proposal import Proposal
from slap_ros.acquisition.proposers import (
    ComposedRewarder,
    ManualProposer,
    ManualRewarder,
    Proposer,
    Rewarder,
    propose,
)
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.bags.reader import read_bag
from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidParameterError, TaskCanceledError

PROPOSERS = ("manual", "induced", "language")
REWARDERS = ("none", "manual", "composed", "language")


@dataclass(frozen=True)
class ProposalRequest:
    """What a proposal is asked for.

    Args:
        domain: Of the task.
        task: With the goal that is to be reached.
        proposer: Of operators, by name.
        rewarder: Of rewards, by name.
        settings: Whom to ask, and what it may cost.

    Raises:
        InvalidParameterError: There is no proposer or rewarder of that name, or it lacks what it
            works from.
    """

    domain: Domain
    task: Task
    proposer: str
    rewarder: str
    settings: InquiryParameters

    def __post_init__(self) -> None:
        for kind, value, known in (
            ("proposer", self.proposer, PROPOSERS),
            ("rewarder", self.rewarder, REWARDERS),
        ):
            if value not in known:
                raise InvalidParameterError(f"{kind} {value!r}: there are {', '.join(known)}")
        if self.proposer == "induced" and not self.settings.demonstrations:
            raise InvalidParameterError(
                "the proposer induced needs the parameter demonstrations of acquisition_node"
            )


def make_proposal(
    request: ProposalRequest, show: Callable[[Entry], None], canceled: Callable[[], bool]
) -> tuple[AcquisitionProblem, Proposal]:
    """Make a proposal.

    Args:
        request: What is asked for.
        show: Called with each answer and each verdict.
        canceled: Asked between answers: whether to stop.

    Returns:
        The problem that was posed, and the proposal.

    Raises:
        ProposalRejectedError: None passed the checks within the budget.
        TaskCanceledError: It was canceled meanwhile.
        SlapError: Why no model could be asked, or no demonstration be read.
    """

    def entry(line: Entry) -> None:
        if canceled():
            raise TaskCanceledError("the proposal was canceled")
        show(line)

    problem = _problem(request)
    log = AttemptLog(show=entry)
    return problem, propose(problem, _proposer(request, problem, log), _rewarder(request, log))


def _problem(request: ProposalRequest) -> AcquisitionProblem:
    problem = AcquisitionProblem.of_task(request.domain, request.task)
    if request.proposer != "induced":
        return problem
    shown = [
        trace
        for path in _bags(request)
        for trace in read_demonstrations(read_bag(path), request.domain)
    ]
    return replace(problem, shown=tuple(shown))


def _bags(request: ProposalRequest) -> list[Path]:
    return [Path(text) for text in request.settings.demonstrations.split()]


def _proposer(request: ProposalRequest, problem: AcquisitionProblem, log: AttemptLog) -> Proposer:
    if request.proposer == "induced":
        bags = ", ".join(path.name for path in _bags(request))
        return InducedProposer(f"demonstrations: {len(problem.shown)}, from {bags}")
    if request.proposer == "language":
        return LanguageProposer(request.settings.inquiry(log))
    written = request.domain.acquisition
    return ManualProposer(written.operators if written else request.domain.operators)


def _rewarder(request: ProposalRequest, log: AttemptLog) -> Rewarder | None:
    if request.rewarder == "language":
        return LanguageRewarder(request.settings.inquiry(log))
    if request.rewarder == "manual":
        written = request.domain.acquisition
        return ManualRewarder(written.rewards if written else {})
    return ComposedRewarder() if request.rewarder == "composed" else None
