# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Asking a model until its answer passes the checks, or the budget is spent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass, serious
from slap_ros.errors import MalformedAnswerError, ProposalRejectedError, SlapError
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import ReplayingClient, open_client, with_recorded
from slap_ros.language.formats import Parsed
from slap_ros.language.prompts import conversation, feedback
from slap_ros.language.request import Client, JsonObject, Reply, Request, Schema
from slap_ros.language.settings import LanguageSettings

D = TypeVar("D")
T = TypeVar("T")

MAX_COMPLAINTS = 8  # complaints that a model is told at once

REFUSED = ("content_filter", "refusal")  # finish reasons of refusals
CUT_SHORT = "length"
TOKEN_LIMITS = ("max_completion_tokens", "max_tokens", "max_output_tokens")  # fields of sampling


@dataclass(frozen=True)
class Question(Generic[D, T]):
    """A question to a model, and how an answer is judged.

    Args:
        subject: Subject of the question, in logs and complaints: ``operator Insert``.
        template: Name of the feedback's template: ``decomposition``, ``operator``, ``reward``.
        name: Name of what is asked for, in the feedback.
        text: Text of the question.
        schema: Schema of the answer.
        parse: Function that converts the text of an answer into a draft.
        check: Function that converts a draft into its meaning, None where something serious is
            wrong, and complaints.
    """

    subject: str
    template: str
    name: str
    text: str
    schema: Schema
    parse: Callable[[str], Parsed[D]]
    check: Callable[[D], tuple[T | None, list[Complaint]]]


@dataclass(frozen=True)
class Answer(Generic[T]):
    """An answer that passed, by itself."""

    value: T
    text: str
    request: str  # sha256 of the request
    warnings: tuple[Complaint, ...]


@dataclass(frozen=True)
class Rejected:
    """An answer that did not pass."""

    text: str
    complaints: Sequence[Complaint]


class Inquiry:
    """One task's conversation with a model."""

    def __init__(
        self, client: Client, settings: LanguageSettings, budget: Budget, log: AttemptLog
    ) -> None:
        """Begin a conversation in which nothing is asked yet.

        Args:
            client: Client that answers.
            settings: Settings of the language model, and of how it samples.
            budget: Budget of the conversation.
            log: Log in which everything is written down.
        """
        self.client = client
        self.settings = settings
        self.budget = budget
        self.log = log
        self._answers = Counter[str]()  # number of answers by subject
        self._scripted = False  # whether an answer was a script's

    @classmethod
    def opened(
        cls,
        settings: LanguageSettings,
        cassette: str,
        limits: BudgetLimits,
        log: AttemptLog,
    ) -> Inquiry:
        """A conversation with the client that the mode of the cassette asks for.

        Args:
            settings: Settings of the language model and its server; a replay without a model takes
                the recorded ones.
            cassette: Mode of the cassette: ``live``, ``off``, ``record:FILE`` or ``replay:FILE``.
            limits: Limits of the budget.
            log: Log in which everything is written down.

        Raises:
            InvalidParameterError: Another mode.
            InvalidCassetteError: The cassette cannot be used.
            LanguageUnavailableError: A server cannot be asked.
        """
        client = open_client(cassette, settings)
        return cls(client, with_recorded(settings, client), Budget(limits), log)

    @property
    def answered_by(self) -> dict[str, Any]:
        """The source of the answers, for records: a model now, a recording of one, or a script."""
        client = self.client
        return {
            "source": client.source,
            "replayed_cassette": client.cassette.digest
            if isinstance(client, ReplayingClient)
            else "",
            "scripted": self._scripted,
        }

    def ask(self, question: Question[D, T], rejected: Rejected | None = None) -> Answer[T]:
        """Ask until an answer passes.

        Args:
            question: Question to ask.
            rejected: Earlier answer with the complaints about it; None for no earlier answer.

        Returns:
            The answer that passed.

        Raises:
            ProposalRejectedError: The budget is spent, with the last complaints.
            SlapError: No answer could be had; see :class:`~slap_ros.language.request.Client`.
        """
        while True:
            answer = self.ask_once(question, rejected)
            if isinstance(answer, Answer):
                return answer
            rejected = answer

    def ask_once(
        self, question: Question[D, T], rejected: Rejected | None = None
    ) -> Answer[T] | Rejected:
        """Ask for one answer, whether it passes or not.

        Args:
            question: Question to ask.
            rejected: Earlier answer with the complaints about it; None for no earlier answer.

        Returns:
            The answer that passed, or the one that did not.

        Raises:
            ProposalRejectedError: The budget is spent already.
            SlapError: No answer could be had; see :class:`~slap_ros.language.request.Client`.
        """
        request = self._request(question, rejected)
        reply = self._complete(question.subject, request, rejected)
        judged = _judge(question, request, reply)
        self.budget.book(reply)
        self._answers[question.subject] += 1
        self._scripted |= reply.scripted
        self.log.answer(
            question.subject, request, reply, judged.cut, judged.complaints, self.budget
        )
        if judged.value is not None and not serious(judged.complaints):
            return Answer(judged.value, reply.text, request.digest, tuple(judged.complaints))
        return Rejected(reply.text, judged.complaints)

    def _request(self, question: Question[D, T], rejected: Rejected | None) -> Request:
        if rejected is None:
            messages = conversation(question.text)
        else:
            words = [complaint.for_model for complaint in rejected.complaints[:MAX_COMPLAINTS]]
            number = self._answers[question.subject]
            complaint = feedback(question.template, words, question.name, number)
            messages = conversation(question.text, rejected.text, complaint)
        return Request(self.settings.model, messages, question.schema, self.settings.sampling)

    def _complete(self, subject: str, request: Request, rejected: Rejected | None) -> Reply:
        try:
            if self.budget.spent:
                raise rejection(self.budget, rejected.complaints if rejected else ())
            return self.client.complete(request, self.budget.seconds_left)
        except SlapError as error:
            self.log.failure(subject, error, self.budget)
            raise


def described(answered_by: Mapping[str, Any]) -> str:
    """The source of the answers in words, from a record of :attr:`Inquiry.answered_by`."""
    source = answered_by.get("source", "an unknown source")
    who = f"a script's ({source})" if answered_by.get("scripted") else f"a model's ({source})"
    cassette = str(answered_by.get("replayed_cassette", ""))
    return f"{who}, replayed from recording {cassette[:12]}…" if cassette else who


def rejection(budget: Budget, complaints: Sequence[Complaint]) -> ProposalRejectedError:
    """The error that ends a task whose budget is spent."""
    last = "; ".join(complaint.for_people for complaint in complaints[:MAX_COMPLAINTS])
    return ProposalRejectedError(
        f"no proposal passed the checks within the budget ({budget}). Last complaints: "
        f"{last or 'none'}. The log has every answer; raise the budget or take another model"
    )


@dataclass(frozen=True)
class _Judgement(Generic[T]):
    """The judgement of an answer: its meaning, complaints, and how much around it was cut off."""

    value: T | None
    complaints: list[Complaint]
    cut: int  # number of characters


def _judge(question: Question[D, T], request: Request, reply: Reply) -> _Judgement[T]:
    def refuse(kind: ComplaintClass, fact: str, advice: str = "") -> _Judgement[T]:
        return _Judgement(None, [Complaint(kind, question.subject, fact, advice=advice)], 0)

    cut = reply.finish_reason == CUT_SHORT
    raising = _how_to_raise_the_limit(request.sampling, reply) if cut else ""

    if reply.refusal is not None or reply.finish_reason in REFUSED:
        return refuse(ComplaintClass.REFUSAL, f"the model refused: {reply.refusal or 'no reason'}")
    if not reply.text.strip():
        begun = f"it was cut at the limit of tokens before it began: {raising}" if cut else ""
        return refuse(ComplaintClass.EMPTY_ANSWER, "the answer is empty", begun)
    try:
        parsed = question.parse(reply.text)
    except MalformedAnswerError as error:
        short = "; it was cut at the limit of tokens" if cut else ""
        return refuse(ComplaintClass.SYNTAX, f"{error}{short}", raising)
    value, complaints = question.check(parsed.draft)
    return _Judgement(value, complaints, parsed.cut)


def _how_to_raise_the_limit(sampling: JsonObject, reply: Reply) -> str:
    """What to change so that an answer has room for all its tokens, thoughts among them."""
    given = [f"{name} ({sampling[name]})" for name in TOKEN_LIMITS if name in sampling]
    spent = f"{reply.completion_tokens} tokens were spent, a model's thoughts among them"
    if given:
        return f"{spent}; raise {' and '.join(given)} in the sampling of --language-settings"
    return (
        f"{spent}; give more by max_tokens in the sampling of --language-settings, or by the "
        "server's own limit or context length"
    )
