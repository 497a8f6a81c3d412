# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposing operators and rewards for a task."""

from __future__ import annotations

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.proposers import Proposers
from slap_ros.core import Domain, Task


@checks_arguments
def propose(
    domain: Domain,
    task: Task,
    proposer: str | Proposers = "manual",
    rewarder: str = "none",
) -> Proposal:
    """Propose operators and rewards for a task, check them, and plan with them.

    Args:
        domain: Domain of the task, as :func:`make` makes it.
        task: Task that the operators are to solve.
        proposer: Name of the proposer of operators: manual, induced or language; or
            :class:`~slap_ros.api.proposers.Proposers`, with its model, cassette and budget.
        rewarder: Name of the rewarder: none, manual, composed or language.

    Returns:
        The proposal, with a plan.

    Raises:
        ProposalRejectedError: None passed the checks.
        InvalidParameterError: There is no such proposer or rewarder, or nothing that it works from.
        InvalidDomainError: Nothing was written by hand, or no reward can be composed.
        SlapError: No model could be asked.
    """
    proposers = Proposers.of(proposer)
    proposal, _ = answer(request_for(domain, task, proposers, rewarder), proposers, AttemptLog())
    return proposal


def request_for(domain: Domain, task: Task, proposers: Proposers, rewarder: str) -> ProposalRequest:
    """What is asked for; see :func:`propose`.

    Args:
        domain: Domain of the task.
        task: Task that the operators are to solve.
        proposers: Proposer of the operators, with its sources, model and budget.
        rewarder: Name of the rewarder.
    """
    shown = proposers.demonstrations_in(domain)
    return ProposalRequest.of_task(domain, task, proposers.proposer, rewarder, shown)


def answer(
    request: ProposalRequest, proposers: Proposers, log: AttemptLog
) -> tuple[Proposal, Inquiry | None]:
    """The proposal that is asked for, and the conversation with a model if there was one.

    Args:
        request: Request: what is to be proposed.
        proposers: Proposer of the operators, with its sources, model and budget.
        log: Log that receives every answer.
    """
    inquiry = proposers.inquiry(request, log)
    return request.propose(inquiry), inquiry
