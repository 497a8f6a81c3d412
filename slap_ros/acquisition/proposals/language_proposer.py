# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators and rewards from a language model, verified (LG-SAIL §4.1, §4.2).

Decompose; an operator for each action; ground; A*; accept, or feed back what is wrong and ask again
for those operators alone, until there is a plan or the budget is spent. Where several rounds bring
no plan, the actions themselves may be wrong, and the decomposition is asked for again.
"""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.acquisition.proposals.inquiry import Answer, Inquiry, Rejected
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal, ProposalProvenance
from slap_ros.acquisition.proposals.proposers import Templates
from slap_ros.acquisition.proposals.questions import (
    Actions,
    about_decomposition,
    about_operator,
    about_reward,
    action_name,
)
from slap_ros.acquisition.proposals.verification import Verification, verify
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import LiftedOperator

ROUNDS = 4  # number of verifications of one decomposition in a row that may fail

Operators = dict[str, Answer[LiftedOperator]]  # by name, in the order of the actions


class LanguageProposer:
    """Asks a model for operators, and verifies them."""

    name = "language"

    def __init__(self, inquiry: Inquiry) -> None:
        """Ask a model in a conversation."""
        self._inquiry = inquiry

    def operators(self, problem: AcquisitionProblem) -> Proposal:
        """Operators that make a plan.

        Raises:
            ProposalRejectedError: The budget is spent.
            SlapError: No answer could be had; see :class:`~slap_ros.language.request.Client`.
        """
        rejected: Rejected | None = None
        while True:
            decomposition = self._inquiry.ask(about_decomposition(problem), rejected)
            answers, verification = self._operators_of(decomposition.value, problem)
            if verification.plan is not None:
                return self._proposal(problem, decomposition, answers, verification)
            rejected = Rejected(decomposition.text, verification.complaints)

    def _operators_of(
        self, actions: Actions, problem: AcquisitionProblem
    ) -> tuple[Operators, Verification]:
        """Ask for a decomposition's operators; there is no plan if the actions may be wrong."""
        answers: Operators = {}

        def ask(action: str, rejected: Rejected | None = None) -> None:
            name = action_name(action)
            described = [answer.value for other, answer in answers.items() if other != name]
            question = about_operator(action, actions, problem, described)
            answers[name] = self._inquiry.ask(question, rejected)

        for action in actions:
            ask(action)
        verification = self._verify(answers, problem)
        for _ in range(ROUNDS - 1):
            if verification.plan is not None:
                break
            for name in verification.culprits:
                rejected = Rejected(answers[name].text, verification.complaints)
                ask(next(a for a in actions if action_name(a) == name), rejected)
            verification = self._verify(answers, problem)
        return answers, verification

    def _verify(self, answers: Operators, problem: AcquisitionProblem) -> Verification:
        verification = verify([answer.value for answer in answers.values()], problem)
        plan = None if verification.plan is None else [str(step) for step in verification.plan]
        self._inquiry.log.verification(plan, verification.complaints, self._inquiry.budget)
        return verification

    def _proposal(
        self,
        problem: AcquisitionProblem,
        decomposition: Answer[Actions],
        answers: Operators,
        verification: Verification,
    ) -> Proposal:
        assert verification.plan is not None
        requests = [answer.request for answer in answers.values()]
        warnings = [c for answer in answers.values() for c in answer.warnings]
        provenance = ProposalProvenance(
            self.name,
            source=self._inquiry.client.source,
            model=self._inquiry.settings.model,
            requests=(decomposition.request, *requests),
            attempts=self._inquiry.budget.attempts,
            tokens=self._inquiry.budget.tokens,
        )
        return Proposal(
            problem.name,
            tuple(answer.value for answer in answers.values()),
            tuple(map(str, verification.plan)),
            provenance,
            remarks=tuple(c.for_people for c in (*warnings, *verification.complaints)),
        )


class LanguageRewarder:
    """Asks a model for rewards, and validates them."""

    name = "language"

    def __init__(self, inquiry: Inquiry) -> None:
        """Ask a model in a conversation.

        Args:
            inquiry: Conversation with a model; it has a budget of its own, or that of the
                operators.
        """
        self._inquiry = inquiry

    def rewards(
        self, operators: Sequence[LiftedOperator], problem: AcquisitionProblem
    ) -> Templates:
        """A template for each operator.

        Raises:
            InvalidDomainError: The problem has no metrics to choose among.
            ProposalRejectedError: The budget is spent.
            SlapError: No answer could be had; see :class:`~slap_ros.language.request.Client`.
        """
        if not problem.metrics:
            raise InvalidDomainError(
                f"domain {problem.name} has no metrics, so there is nothing to make rewards of"
            )
        questions = ((op.name, about_reward(op, problem)) for op in operators)
        return {name: self._inquiry.ask(question).value for name, question in questions}
