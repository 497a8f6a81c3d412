# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests for proposals: for which problem, by which proposer, from which material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from slap_ros.acquisition.proposals.induction import HOLD_STEPS, InducedProposer, hold_steps_of
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.language_proposer import LanguageProposer, LanguageRewarder
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposer_names import (
    COMPOSED,
    INDUCED,
    LANGUAGE,
    MANUAL,
    NO_REWARDER,
    PROPOSERS,
    REWARDERS,
    require_known,
)
from slap_ros.acquisition.proposals.proposers import (
    ComposedRewarder,
    ManualProposer,
    ManualRewarder,
    Proposer,
    Rewarder,
    Templates,
    propose,
)
from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import LiftedOperator
from slap_ros.skills.demonstrator import AtomTrace


@dataclass(frozen=True)
class Demonstrations:
    """Demonstrations, and where they are from.

    Args:
        traces: Atoms that held in each step, for each demonstration.
        source: Description of where the demonstrations are from, for people.
    """

    traces: tuple[AtomTrace, ...] = ()
    source: str = ""


@dataclass(frozen=True)
class ProposalRequest:
    """A request for a proposal: for which problem, by which proposer, from which material.

    Args:
        problem: Problem that the proposal is for.
        proposer: Name of the proposer of operators.
        rewarder: Name of the rewarder, or ``none``.
        operators: Operators written by hand.
        rewards: Reward templates written by hand, by operator name.
        hold_steps: Environment steps that atoms must stay for a demonstrated change to count.
        source: Description of where written operators or demonstrations are from, for provenance.

    Raises:
        InvalidParameterError: There is no proposer or rewarder of that name, or it lacks what it
            works from.
    """

    problem: AcquisitionProblem
    proposer: str = MANUAL
    rewarder: str = NO_REWARDER
    operators: Sequence[LiftedOperator] = ()
    rewards: Templates = field(default_factory=dict)
    hold_steps: int = HOLD_STEPS
    source: str = ""

    def __post_init__(self) -> None:
        require_known("proposer", self.proposer, PROPOSERS)
        require_known("rewarder", self.rewarder, (NO_REWARDER, *REWARDERS))
        if self.proposer == INDUCED and not self.problem.shown:
            raise InvalidParameterError("the proposer induced works from demonstrations; give some")

    @classmethod
    def of_task(
        cls,
        domain: Domain,
        task: Task,
        proposer: str,
        rewarder: str,
        shown: Demonstrations = Demonstrations(),
    ) -> ProposalRequest:
        """A request for operators that solve a domain's task.

        Args:
            domain: Domain, with the operators and rewards that people wrote for it.
            task: Task to solve: where to start, and what to reach.
            proposer: Name of the proposer of operators.
            rewarder: Name of the rewarder, or ``none``.
            shown: Demonstrations that the proposer ``induced`` works from.

        Raises:
            InvalidParameterError: As for the class.
        """
        problem = AcquisitionProblem.of_task(domain, task)
        written, source = domain.acquisition, "the domain's own"
        if proposer == INDUCED:
            source = f"demonstrations: {len(shown.traces)}, from {shown.source}"
        return cls(
            replace(problem, shown=shown.traces),
            proposer,
            rewarder,
            written.operators if written is not None else domain.operators,
            written.rewards if written is not None else {},
            hold_steps_of(domain.execution.control_period_s),
            source,
        )

    @property
    def asks_model(self) -> bool:
        """Whether a language model has to be asked."""
        return LANGUAGE in (self.proposer, self.rewarder)

    def propose(self, inquiry: Inquiry | None = None) -> Proposal:
        """Make the proposal.

        Args:
            inquiry: Conversation with a model, where a model has to be asked.

        Raises:
            ProposalRejectedError: No proposal passed the checks.
            InvalidDomainError: Nothing was written by hand, or no reward can be composed.
            SlapError: Why no model could be asked.
        """
        return propose(self.problem, self._proposer(inquiry), self._rewarder(inquiry))

    def make_rewards(
        self, operators: Sequence[LiftedOperator], inquiry: Inquiry | None
    ) -> Templates:
        """Rewards alone, for operators that are there already.

        Args:
            operators: Operators to reward.
            inquiry: Conversation with a model, where a model has to be asked.

        Raises:
            InvalidDomainError: Nothing was written by hand, or no reward can be composed.
            SlapError: Why no model could be asked.
        """
        rewarder = self._rewarder(inquiry)
        return {} if rewarder is None else rewarder.rewards(operators, self.problem)

    def _proposer(self, inquiry: Inquiry | None) -> Proposer:
        if self.proposer == LANGUAGE:
            return LanguageProposer(_asked(inquiry))
        if self.proposer == INDUCED:
            return InducedProposer(self.source, self.hold_steps)
        return ManualProposer(self.operators, self.source)

    def _rewarder(self, inquiry: Inquiry | None) -> Rewarder | None:
        if self.rewarder == LANGUAGE:
            return LanguageRewarder(_asked(inquiry))
        if self.rewarder == MANUAL:
            return ManualRewarder(self.rewards)
        return ComposedRewarder() if self.rewarder == COMPOSED else None


def _asked(inquiry: Inquiry | None) -> Inquiry:
    assert inquiry is not None  # as asks_model says
    return inquiry
