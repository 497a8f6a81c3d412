# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was asked, answered and complained about, as JSON lines; the same in replay to the byte."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from slap_ros.acquisition.proposals.complaints import Complaint
from slap_ros.errors import SlapError, StorageFullError
from slap_ros.language.budget import Budget
from slap_ros.language.request import Reply, Request

MAX_ANSWER = 16_000  # characters of an answer that are kept

Entry = dict[str, Any]


class AttemptLog:
    """Lines about one proposal; kept, and written to a file and shown as they come."""

    def __init__(
        self, path: Path | None = None, show: Callable[[Entry], None] | None = None
    ) -> None:
        """Begin without lines.

        Args:
            path: A file of JSON lines, which is replaced; none if left out.
            show: Called with each line, if given.

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
        """An answer, and what is wrong with it by itself.

        Args:
            subject: What was asked for, as ``operator Insert``.
            request: What was asked.
            reply: What came back.
            cut: Characters around the answer that were cut off.
            complaints: Warnings among them.
            budget: After it.
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
        """What the planner says of all operators together.

        Args:
            plan: A shortest one; None where there is none.
            complaints: Warnings among them.
            budget: As it is.
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
        """Why no answer could be had, or no more may be asked for.

        Args:
            subject: What was asked for.
            error: What ended it.
            budget: As it is.
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

    def classes(self) -> Counter[str]:
        """How often each class of complaint occurs, warnings too."""
        return Counter(name for entry in self.entries for name in entry.get("errors", ()))

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
