# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The log of questions, answers and complaints, as JSON lines; the same bytes in a replay."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from slap_ros.acquisition.proposals.complaints import Complaint
from slap_ros.errors import SlapError, StorageFullError
from slap_ros.language.budget import Budget
from slap_ros.language.request import Reply, Request

MAX_ANSWER = 16_000  # number of characters of an answer that are kept

Entry = dict[str, Any]


class AttemptLog:
    """The log of one proposal: lines that are kept, written to a file and shown as they come."""

    def __init__(
        self, path: Path | None = None, show: Callable[[Entry], None] | None = None
    ) -> None:
        """Begin an empty log.

        Args:
            path: Path of a file of JSON lines, which is replaced; None for no file.
            show: Function that is called with each line; None for no function.

        Raises:
            StorageFullError: The file cannot be written.
        """
        self.entries: list[Entry] = []
        self._path = path
        self._show = show
        if path is not None:
            self._write("", "w")

    def answer(
        self,
        subject: str,
        request: Request,
        reply: Reply,
        cut: int,
        complaints: Sequence[Complaint],
        budget: Budget,
    ) -> None:
        """Log an answer, and what is wrong with it by itself.

        Args:
            subject: Subject of the question, as ``operator Insert``.
            request: Request that was sent.
            reply: Reply that came back.
            cut: Number of characters around the answer that were cut off.
            complaints: Complaints about the answer, warnings among them.
            budget: Budget after the answer.
        """
        text = reply.text
        self._add(
            {
                "event": "answer",
                "subject": subject,
                "request": request.digest,
                "answer": text if len(text) <= MAX_ANSWER else f"{text[:MAX_ANSWER]}…",
                "characters": len(text),
                "cut": cut,
                "degree": reply.degree.value,
                "tokens": reply.tokens,
                "seconds": reply.seconds,
                **_judged(complaints),
                "left": budget.left(),
            }
        )

    def verification(
        self, plan: Sequence[str] | None, complaints: Sequence[Complaint], budget: Budget
    ) -> None:
        """Log what the planner finds for all operators together.

        Args:
            plan: Steps of a shortest plan; None where there is no plan.
            complaints: Complaints about the operators, warnings among them.
            budget: Budget that is left.
        """
        self._add(
            {
                "event": "verification",
                "plan": None if plan is None else list(plan),
                **_judged(complaints),
                "left": budget.left(),
            }
        )

    def failure(self, subject: str, error: SlapError, budget: Budget) -> None:
        """Log why there is no answer, or no further question.

        Args:
            subject: Subject of the question, as ``operator Insert``.
            error: Error that ended the conversation.
            budget: Budget that is left.
        """
        self._add(
            {
                "event": "failure",
                "subject": subject,
                "error": error.code.name,
                "message": str(error),
                "left": budget.left(),
            }
        )

    def _add(self, entry: Entry) -> None:
        self.entries.append(entry)
        if self._show is not None:
            self._show(entry)
        if self._path is not None:
            self._write(json.dumps(entry, allow_nan=False) + "\n", "a")

    def _write(self, text: str, mode: str) -> None:
        assert self._path is not None
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open(mode, encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            raise StorageFullError(f"cannot write {self._path}: {error.strerror}") from error


def _judged(complaints: Sequence[Complaint]) -> Entry:
    return {
        "errors": sorted({complaint.kind.value for complaint in complaints}),
        "complaints": [complaint.for_people for complaint in complaints],
    }
