# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A person as the channel: who has a chat but no key carries questions there and answers back.

Each question is whole, so that each can be put to a new chat: a rejected answer and what was wrong
with it are part of the next question, as a server would get them.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp
from typing import Protocol, TextIO

from slap_ros.errors import InvalidParameterError, LanguageUnavailableError
from slap_ros.files import read_bytes, reason_of, write_whole
from slap_ros.language.client import CHARACTERS_PER_TOKEN  # nobody counts here
from slap_ros.language.clipboard import copy_to_clipboard
from slap_ros.language.request import OutputDegree, Reply, Request, replace_unprintable
from slap_ros.language.settings import FOLDER_SCHEME, LanguageSettings, asked_by_hand

UNNAMED = "unnamed"
END = "."  # a line that ends a pasted answer
FROM_FILE = "@"  # before the path of a file that has the answer
MAX_LINE = 4095  # bytes; a terminal cuts longer ones without a word (termios, MAX_CANON)
MAX_ANSWER_BYTES = 1_000_000
POLL = 0.5  # s; a file that has not changed for so long is whole


class AnswerChannel(Protocol):
    """How questions get to a person, and answers back."""

    def answer(self, number: int, question: str) -> str:
        """The answer to a question.

        Args:
            number: Number of the question, from 1.
            question: Text for the model.

        Raises:
            LanguageUnavailableError: There will be no answer.
            InvalidParameterError: What is there is not about this question.
        """


class AskingClient:
    """Has a person ask a model. Their time is not counted: it says nothing about the model."""

    def __init__(self, settings: LanguageSettings, channel: AnswerChannel | None = None) -> None:
        """Ask nobody yet.

        Args:
            settings: Settings whose model is ``ask`` or ``ask:NAME``.
            channel: Where questions go; None for what the settings say: a folder, or the terminal.

        Raises:
            LanguageUnavailableError: There is neither a folder nor a terminal.
        """
        self._channel = channel or _channel(settings)
        self._model = asked_by_hand(settings.model) or UNNAMED
        self._number = 0

    @property
    def source(self) -> str:
        """The name that the person gave."""
        return f"{self._model}, asked by hand"

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request; see :class:`~.request.Client`."""
        del seconds_left
        self._number += 1
        question = _question(request)
        text = replace_unprintable(self._channel.answer(self._number, question))
        return Reply(
            text,
            None,
            "stop",
            len(question) // CHARACTERS_PER_TOKEN,
            len(text) // CHARACTERS_PER_TOKEN,
            self._model,
            OutputDegree.TEXT,
            0.0,
        )


class FolderChannel:
    """Questions and answers as files, such as ``001-question.md`` and ``001-answer.md``.

    Answers that are there already are used, so that a conversation goes on where it was left.
    """

    def __init__(self, folder: Path, tell: Callable[[str], None]) -> None:
        """Use a folder, which is made with the first question.

        Args:
            folder: Folder of the conversation.
            tell: Shows a line to the person.
        """
        self._folder = folder
        self._tell = tell

    def answer(self, number: int, question: str) -> str:
        """See :class:`AnswerChannel`."""
        asked = self._folder / f"{number:03}-question.md"
        answered = self._folder / f"{number:03}-answer.md"
        self._write(asked, question)
        if not answered.exists():
            self._tell(f"question {number} is in {asked}; save the answer as {answered}")
        return _whole_text(answered)

    def _write(self, path: Path, question: str) -> None:
        try:
            if path.exists() and read_bytes(path).decode() != question:
                raise InvalidParameterError(
                    f"{path} has another question: the folder is another conversation's, or the "
                    "task was changed; choose another folder"
                )
            write_whole(path, question)
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidParameterError(f"cannot write {path}: {reason_of(error)}") from error


class TerminalChannel:
    """Questions on the clipboard and in files, answers pasted into the terminal."""

    def __init__(
        self,
        answers: TextIO,
        tell: Callable[[str], None],
        copy: Callable[[str], bool] = copy_to_clipboard,
    ) -> None:
        """Use a terminal.

        Args:
            answers: What the person types and pastes.
            tell: Shows a line to the person.
            copy: Puts a text on the clipboard; whether it could.
        """
        self._answers = answers
        self._tell = tell
        self._copy = copy
        self._folder = Path(mkdtemp(prefix="slap-questions-"))

    def answer(self, number: int, question: str) -> str:
        """See :class:`AnswerChannel`."""
        path = self._folder / f"{number:03}-question.md"
        write_whole(path, question)
        where = "on the clipboard, and in" if self._copy(question) else "in"
        self._tell(f"question {number} is {where} {path}: put it to a new chat")
        self._tell(f"paste the answer, then a line with {END!r} alone; or {FROM_FILE}FILE")
        while True:
            pasted = self._pasted()
            if pasted is not None:
                return pasted

    def _pasted(self) -> str | None:
        """What was pasted; None where something is wrong with it, which was said."""
        lines: list[str] = []
        for line in iter(self._answers.readline, ""):
            if not lines and line.startswith(FROM_FILE):
                return self._read(Path(line.removeprefix(FROM_FILE).strip()).expanduser())
            if line.strip() == END:
                break
            lines.append(line)
        if any(len(line.encode()) >= MAX_LINE for line in lines):
            self._tell(f"a line was too long for a terminal: save the answer, type {FROM_FILE}FILE")
            return None
        if not lines:
            raise LanguageUnavailableError("no answer was given")
        return "".join(lines)

    def _read(self, path: Path) -> str | None:
        try:
            return read_bytes(path, MAX_ANSWER_BYTES).decode("utf-8", "replace")
        except OSError as error:
            self._tell(f"cannot read {path}: {reason_of(error)}")
            return None


def _channel(settings: LanguageSettings) -> AnswerChannel:
    if settings.base_url.startswith(FOLDER_SCHEME):
        folder = Path(settings.base_url.removeprefix(FOLDER_SCHEME)).expanduser()
        return FolderChannel(folder, _tell)
    if not sys.stdin.isatty():
        raise LanguageUnavailableError(
            f"--model {settings.model}: there is no terminal to paste answers into; give "
            f"--base-url {FOLDER_SCHEME}PATH, where questions and answers are files"
        )
    return TerminalChannel(sys.stdin, _tell)


def _tell(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def _question(request: Request) -> str:
    """A whole conversation as one text."""
    said = []
    for message in request.messages:
        mine = message.role == "assistant"
        said.append(f"Your answer was:\n\n{message.content}" if mine else message.content)
    return "\n\n".join((*said, request.schema.text_format)) + "\n"


def _whole_text(path: Path) -> str:
    """What a file has, once it is there and does not grow any more."""
    before = b""
    while True:
        try:
            content = read_bytes(path, MAX_ANSWER_BYTES) if path.exists() else b""
        except OSError as error:
            raise LanguageUnavailableError(f"cannot read {path}: {reason_of(error)}") from error
        if content.strip() and content == before:
            return content.decode("utf-8", "replace")
        before = content
        time.sleep(POLL)
