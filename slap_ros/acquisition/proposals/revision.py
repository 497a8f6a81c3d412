# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Failures of training go back into the question, which the paper names as its future work.

A model is told of each skill that was given up: how it ended, which atoms were wrong, and what the
metrics of its reward came to. It may change the reward, and the operator. Each change passes the
checks that every proposal passes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass
from slap_ros.acquisition.proposals.inquiry import Inquiry, Rejected
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.acquisition.proposals.proposer_names import LANGUAGE
from slap_ros.acquisition.proposals.questions import about_operator, about_reward
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.skills.operator_json import operator_data, template_data

Failure = Mapping[str, Any]  # as the record of a library has it, of a skill that was given up


@dataclass(frozen=True)
class Reviser:
    """Asks a model again for what could not be learned.

    Args:
        request: Request that the proposal answered.
        inquiry: Conversation with the model.
    """

    request: ProposalRequest
    inquiry: Inquiry

    def revise(self, proposal: Proposal, failures: Mapping[str, Failure]) -> Proposal:
        """The proposal with other operators and rewards for the skills that were given up.

        Args:
            proposal: Proposal whose skills were trained.
            failures: How each skill failed that was given up, by name.

        Raises:
            ProposalRejectedError: The budget is spent.
            SlapError: No answer could be had; see :class:`~slap_ros.language.request.Client`.
        """
        for name in sorted(failures):
            proposal = self._revise(proposal, name, failures[name])
        return proposal

    def _revise(self, proposal: Proposal, name: str, failure: Failure) -> Proposal:
        if self.request.proposer == LANGUAGE:
            proposal = self._with_operator(proposal, name, failure)
        (operator,) = (one for one in proposal.operators if one.name == name)
        problem, old = self.request.problem, proposal.rewards[name]
        if self.request.rewarder == LANGUAGE:
            written = json.dumps({"terms": template_data(old)["terms"]})
            rejected = Rejected(written, [_complaint(f"reward of {name}", failure)])
            new = self.inquiry.ask(about_reward(operator, problem), rejected).value
        else:
            new = self.request.make_rewards([operator], self.inquiry)[name]
        return replace(proposal, rewards={**proposal.rewards, name: new})

    def _with_operator(self, proposal: Proposal, name: str, failure: Failure) -> Proposal:
        """The proposal with another operator, where there is still a plan with it."""
        problem = self.request.problem
        operators = {operator.name: operator for operator in proposal.operators}
        actions = {name: operator.signature for name, operator in operators.items()}
        others = [operator for operator in operators.values() if operator.name != name]
        question = about_operator(actions[name], tuple(actions.values()), problem, others)
        written = json.dumps(operator_data(operators[name]))
        rejected = Rejected(written, [_complaint(f"operator {name}", failure)])
        operators[name] = self.inquiry.ask(question, rejected).value
        verification = verify(list(operators.values()), problem)
        plan = None if verification.plan is None else tuple(map(str, verification.plan))
        self.inquiry.log.verification(plan, verification.complaints, self.inquiry.budget)
        if plan is None:
            return proposal
        return replace(proposal, operators=tuple(operators.values()), plan=plan)


def _complaint(subject: str, failure: Failure) -> Complaint:
    """What a model is told of a skill that was given up."""
    facts = [f"trained with it, the skill was not learned ({failure['why']})"]
    if ends := failure.get("ends"):
        told = ", ".join(f"{count} times {end}" for end, count in ends.items())
        facts.append(f"of {failure['states']} episodes, {told}")
    if atoms := failure.get("atoms"):
        facts.append(f"wrong in the end, most often: {', '.join(atoms)}")
    if metrics := failure.get("metrics"):
        told = ", ".join(f"{name} = {value:g}" for name, value in metrics.items())
        facts.append(f"mean of the normalised metrics in the end: {told}")
    return Complaint(ComplaintClass.NOT_LEARNED, subject, "; ".join(facts))
