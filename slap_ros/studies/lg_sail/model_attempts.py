# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attempts of a language model at operators, plans and rewards, each without a second chance.

What studies count. An attempt at operators is a decomposition and an operator for each of its
actions, asked for once. It succeeds where all pass their checks and chain to the goal. It ends with
the first answer that does not pass: what would follow costs, and changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.complaints import Complaint, serious
from slap_ros.acquisition.proposals.drafts import check_decomposition, read_operator
from slap_ros.acquisition.proposals.inquiry import Answer, Inquiry, Question
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.questions import (
    Actions,
    about_decomposition,
    about_operator,
    about_plan,
    about_reward,
    action_name,
)
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.errors import InvalidCassetteError
from slap_ros.imitation.unchecked_plans import UncheckedPlan, UncheckedStep
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.formats import ActionDraft
from slap_ros.language.request import Client, Reply, Request
from slap_ros.language.settings import LanguageSettings
from slap_ros.relational import LiftedOperator

D = TypeVar("D")
T = TypeVar("T")

VERIFICATION = "verification"  # of all operators together
SEED = "seed"  # a field of sampling: servers that know it answer differently to each


class ModelsOnly:
    """Whoever answers, as long as a model does: what a script says is no result."""

    def __init__(self, client: Client) -> None:
        """Ask this client."""
        self._client = client

    @property
    def source(self) -> str:
        """See :class:`~slap_ros.language.request.Client`."""
        return self._client.source

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """See :class:`~slap_ros.language.request.Client`.

        Raises:
            InvalidCassetteError: A script answered.
        """
        reply = self._client.complete(request, seconds_left)
        if reply.scripted:
            raise InvalidCassetteError(
                f"{self.source} answers by a script: what it says is no result of a study. Ask a "
                "model, or replay a cassette that was recorded from one"
            )
        return reply


@dataclass(frozen=True)
class LanguageModel:
    """A language model that a study asks.

    Args:
        client: Client that answers.
        settings: Name of the model, and how it samples.
    """

    client: Client
    settings: LanguageSettings

    def inquiry(self, number: int, limits: BudgetLimits) -> Inquiry:
        """A conversation of its own for an attempt.

        Args:
            number: Number of the attempt, which becomes the seed of the model's sampling.
            limits: Budget of the attempt.
        """
        sampling = {**self.settings.sampling, SEED: number}
        settings = replace(self.settings, sampling=sampling)
        return Inquiry(self.client, settings, Budget(limits), AttemptLog())


@dataclass(frozen=True)
class Attempt:
    """How an attempt ended, and what it cost.

    Args:
        errors: Classes of what is wrong, by what was asked for; none where it passed.
        tokens: Number of tokens spent on the attempt.
        seconds: Time waited for answers, s.
    """

    errors: Mapping[str, tuple[str, ...]]
    tokens: int
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.errors

    @property
    def verdict(self) -> str:
        """``passed``, or which answers did not, with the classes of what is wrong with each."""
        wrong = (
            f"{subject.partition(' ')[0]}: {', '.join(kinds)}"
            for subject, kinds in self.errors.items()
        )
        return "; ".join(wrong) or "passed"

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Attempt:
        """The attempt that :func:`dataclasses.asdict` made such data of."""
        errors = {subject: tuple(kinds) for subject, kinds in data["errors"].items()}
        return cls(errors, data["tokens"], data["seconds"])


class _Asker:
    """Asks once for each thing, and collects what is wrong."""

    def __init__(self, inquiry: Inquiry) -> None:
        self._inquiry = inquiry
        self._errors: dict[str, tuple[str, ...]] = {}

    def ask(self, question: Question[D, T]) -> T | None:
        """What the answer means; None where it does not pass."""
        answer = self._inquiry.ask_once(question)
        if isinstance(answer, Answer):
            return answer.value
        self.complain(question.subject, answer.complaints)
        return None

    def complain(self, subject: str, complaints: Iterable[Complaint]) -> None:
        self._errors[subject] = tuple(sorted({str(c.kind) for c in serious(complaints)}))

    def attempt(self) -> Attempt:
        budget = self._inquiry.budget
        return Attempt(self._errors, budget.tokens, budget.seconds)


def attempt_operators(
    inquiry: Inquiry, problem: AcquisitionProblem
) -> tuple[Attempt, tuple[LiftedOperator, ...]]:
    """Ask once for a decomposition and each of its operators, until an answer does not pass.

    Args:
        inquiry: Conversation with the model.
        problem: Problem that the operators are for.

    Returns:
        What came of it, and the operators; none unless the attempt passed.
    """
    asker = _Asker(inquiry)
    actions = asker.ask(about_decomposition(problem)) or ()
    operators: list[LiftedOperator] = []
    for action in actions:
        operator = asker.ask(about_operator(action, actions, problem))
        if operator is None:
            break
        operators.append(operator)
    if asker.attempt().passed:
        verification = verify(operators, problem)
        if verification.plan is None:
            asker.complain(VERIFICATION, verification.complaints)
    attempt = asker.attempt()
    return attempt, tuple(operators) if attempt.passed else ()


def attempt_plan(
    inquiry: Inquiry, operators: Sequence[LiftedOperator], problem: AcquisitionProblem
) -> Attempt:
    """Ask once for a plan.

    Args:
        inquiry: Conversation with the model.
        operators: Operators that have a plan.
        problem: Problem to plan for: initial state and goal.

    Returns:
        What came of it.
    """
    asker = _Asker(inquiry)
    asker.ask(about_plan(operators, problem))
    return asker.attempt()


def attempt_unchecked_plan(
    inquiry: Inquiry, problem: AcquisitionProblem
) -> tuple[Attempt, UncheckedPlan]:
    """Ask once for a decomposition, its operators and a plan, and take what can be read of it.

    Args:
        inquiry: Conversation with the model.
        problem: Problem to plan for: initial state and goal.

    Returns:
        What it cost, and the plan. Only an answer that cannot be read ends the attempt.
    """
    asker = _Asker(inquiry)
    steps = _written_steps(asker, problem)
    attempt = asker.attempt()
    return attempt, UncheckedPlan(steps, "" if attempt.passed else attempt.verdict)


def _written_steps(asker: _Asker, problem: AcquisitionProblem) -> tuple[UncheckedStep, ...]:
    """The steps of a model's plan; none where an answer cannot be read."""
    read_actions = partial(_each_once, problem=problem)
    actions = asker.ask(_unchecked(about_decomposition(problem), read_actions)) or ()
    operators: list[LiftedOperator] = []
    for action in actions:
        read = partial(read_operator, name=action_name(action), problem=problem)
        operator = asker.ask(_unchecked(about_operator(action, actions, problem), read))
        if operator is None:
            return ()
        operators.append(operator)
    if not operators:
        return ()
    plan = asker.ask(_unchecked(about_plan(operators, problem), tuple)) or ()
    return tuple(UncheckedStep.of(step, operators) for step in plan)


def _unchecked(question: Question[D, Any], read: Callable[[D], T]) -> Question[D, T]:
    """A question whose answer is taken for whatever it says."""
    return replace(question, check=lambda draft: (read(draft), []))


def _each_once(drafts: Sequence[ActionDraft], problem: AcquisitionProblem) -> Actions:
    """The actions of a decomposition, the first of each name."""
    actions, _ = check_decomposition(drafts, problem)
    first: dict[str, str] = {}
    for action in actions:
        first.setdefault(action_name(action), action)
    return tuple(first.values())


def attempt_rewards(
    inquiry: Inquiry,
    operators: Sequence[LiftedOperator],
    problem: AcquisitionProblem,
    with_definitions: bool,
) -> Attempt:
    """Ask once for the reward of each operator.

    Args:
        inquiry: Conversation with the model.
        operators: Operators that need rewards.
        problem: Problem with the metrics to choose among.
        with_definitions: Whether the metrics' source is quoted.

    Returns:
        What came of it.
    """
    asker = _Asker(inquiry)
    for operator in operators:
        asker.ask(about_reward(operator, problem, with_definitions))
    return asker.attempt()
