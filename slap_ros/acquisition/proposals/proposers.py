# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposers of operators and rewarders, each kind behind one method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from slap_ros.acquisition.proposals.complaints import serious
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal, ProposalProvenance
from slap_ros.acquisition.proposals.reward_templates import compose_reward
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.errors import InvalidDomainError, ProposalRejectedError
from slap_ros.relational import LiftedOperator, RewardTemplate

Templates = Mapping[str, RewardTemplate]  # reward templates by operator name


class Proposer(Protocol):
    """A source of the operators that a task is made of."""

    name: str

    def operators(self, problem: AcquisitionProblem) -> Proposal:
        """Propose operators with a plan, no rewards yet.

        Raises:
            ProposalRejectedError: No proposal passes the checks.
        """


class Rewarder(Protocol):
    """A source of rewards: the metrics that lead to an operator's effects."""

    name: str

    def rewards(
        self, operators: Sequence[LiftedOperator], problem: AcquisitionProblem
    ) -> Templates:
        """Propose a reward template for each operator.

        Raises:
            ProposalRejectedError: No proposal passes the checks.
            InvalidDomainError: The problem's predicates rest on no metrics that would do.
        """


def propose(
    problem: AcquisitionProblem, proposer: Proposer, rewarder: Rewarder | None = None
) -> Proposal:
    """Ask the proposer for operators and the rewarder for rewards.

    Args:
        problem: Problem that operators and rewards are for.
        proposer: Proposer of operators.
        rewarder: Rewarder; None where no skill is to be learned.

    Returns:
        The proposal, its provenance naming both.
    """
    proposal = proposer.operators(problem)
    if rewarder is None:
        return proposal
    rewards = rewarder.rewards(proposal.operators, problem)
    provenance = replace(proposal.provenance, rewarder=rewarder.name)
    return replace(proposal, rewards=rewards, provenance=provenance)


class ManualProposer:
    """Operators that people wrote: a domain's own (LEAGUE's way), or those of a file."""

    name = "manual"

    def __init__(self, operators: Sequence[LiftedOperator], source: str = "") -> None:
        """Propose these operators.

        Args:
            operators: Operators of the domain or of a file.
            source: Description of where the operators are from, for provenance.

        Raises:
            InvalidDomainError: There are no operators.
        """
        if not operators:
            raise InvalidDomainError(
                "no operators were written by hand for this domain; use another proposer"
            )
        self._operators = tuple(operators)
        self._source = source

    def operators(self, problem: AcquisitionProblem) -> Proposal:
        """The operators, checked."""
        return checked(self._operators, problem, ProposalProvenance(self.name, source=self._source))


class ManualRewarder:
    """Rewards that people wrote."""

    name = "manual"

    def __init__(self, templates: Templates) -> None:
        """Propose these templates, by operator name."""
        self._templates = templates

    def rewards(
        self, operators: Sequence[LiftedOperator], problem: AcquisitionProblem
    ) -> Templates:
        """The templates of these operators.

        Raises:
            InvalidDomainError: One of them has none.
        """
        for operator in operators:
            if operator.name not in self._templates:
                raise InvalidDomainError(
                    f"domain {problem.name}: no reward was written by hand for {operator.name}; "
                    "use the rewarder composed"
                )
        return {operator.name: self._templates[operator.name] for operator in operators}


class ComposedRewarder:
    """Rewards from the metrics behind what operators add; no model, and none claimed."""

    name = "composed"

    def rewards(
        self, operators: Sequence[LiftedOperator], problem: AcquisitionProblem
    ) -> Templates:
        """See :class:`Rewarder`; templates are composed from metrics."""
        return {operator.name: compose_reward(operator, problem) for operator in operators}


def checked(
    operators: tuple[LiftedOperator, ...],
    problem: AcquisitionProblem,
    provenance: ProposalProvenance,
) -> Proposal:
    """A proposal of operators that no model will be asked about again.

    Args:
        operators: Operators, each sound by itself.
        problem: Problem that operators and rewards are for.
        provenance: Provenance of the operators.

    Raises:
        ProposalRejectedError: They make no plan.
    """
    verification = verify(operators, problem)
    remarks = tuple(complaint.for_people for complaint in verification.complaints)
    if verification.plan is None or serious(verification.complaints):
        raise ProposalRejectedError(f"these operators make no plan. {' '.join(remarks)}")
    plan = tuple(map(str, verification.plan))
    return Proposal(problem.name, operators, plan, provenance, remarks=remarks)
