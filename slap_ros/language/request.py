# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One exchange with a language model as data: what is asked, and what came back."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any, Literal, Protocol

JsonObject = Mapping[str, Any]


class OutputDegree(StrEnum):
    """How strictly an answer's structure is asked for, strictest first."""

    JSON_SCHEMA = "json_schema"  # the server is given a strict schema
    JSON_OBJECT = "json_object"  # the server is asked for JSON; the schema is in the prompt
    TEXT = "text"  # the paper's plain text

    @property
    def next(self) -> OutputDegree | None:
        """The next less strict one."""
        degrees = list(OutputDegree)
        position = degrees.index(self) + 1
        return degrees[position] if position < len(degrees) else None


@dataclass(frozen=True)
class Message:
    """One message of a conversation."""

    role: Literal["system", "user", "assistant"]
    content: str


@dataclass(frozen=True)
class Schema:
    """What an answer must look like, twice: for servers that take schemas, and for the others."""

    name: str
    definition: JsonObject  # a strict JSON schema
    text_format: str  # the plain text's form, in words and by example


@dataclass(frozen=True)
class Request:
    """What a model is asked.

    It does not say to which degree the server is asked for structure: that depends on the server,
    and a recorded exchange shall be found again whatever it was.
    """

    model: str
    messages: tuple[Message, ...]
    schema: Schema
    sampling: JsonObject = field(default_factory=dict)  # temperature, seed, ...: sent as it is

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def canonical(self) -> str:
        """JSON that is the same for equal requests: keys sorted, no white space, ASCII."""
        return json.dumps(
            {
                "model": self.model,
                "messages": [{"role": m.role, "content": m.content} for m in self.messages],
                "schema": {
                    "name": self.schema.name,
                    "definition": self.schema.definition,
                    "text_format": self.schema.text_format,
                },
                "sampling": dict(self.sampling),
            },
            sort_keys=True,
            separators=(",", ":"),
            allow_nan=False,
        )

    @cached_property
    def digest(self) -> str:
        """The sha256 of the canonical JSON, in hexadecimal."""
        return hashlib.sha256(self.canonical.encode()).hexdigest()


@dataclass(frozen=True)
class Reply:
    """What came back.

    Args:
        text: The answer; empty where the model gave none.
        refusal: The model's words where it refused, else None.
        finish_reason: Why it stopped, in the server's words: ``stop``, ``length``, ...
        prompt_tokens: Number of tokens of the question, as the server counts them; estimated where
            it does not.
        completion_tokens: Number of tokens of the answer, as the server counts them; estimated
            where it does not.
        model: What the server says answered.
        degree: Degree to which structure was asked for.
        seconds: From the question to the answer, repetitions and pauses included.
        scripted: Whether the server says that no model answered, but a script.
    """

    text: str
    refusal: str | None
    finish_reason: str
    prompt_tokens: int
    completion_tokens: int
    model: str
    degree: OutputDegree
    seconds: float
    scripted: bool = False

    @property
    def tokens(self) -> int:
        """Of question and answer together."""
        return self.prompt_tokens + self.completion_tokens


class Client(Protocol):
    """Whoever answers requests: a server, a recording of one, a model in this process."""

    @property
    def source(self) -> str:
        """What answers, for provenance: never anything secret."""

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request.

        Args:
            request: What is asked.
            seconds_left: Time that is left of the budget, s; the wait ends then.

        Returns:
            The answer, whatever its quality.

        Raises:
            LanguageOffError: Models are not to be called.
            LanguageUnavailableError: No answer could be had.
            LanguageRefusedError: The server does not accept the request: key, model, address.
            CassetteMissError: A recording does not have this request.
        """


def replace_unprintable(text: str) -> str:
    """Text without control characters (but line ends and tabs) and without lone surrogates.

    What a model wrote goes into logs, terminals and further questions; it is data there. Spaces of
    other kinds become plain ones.
    """
    whole = text.encode("utf-8", "replace").decode("utf-8")
    plain = whole.replace("\r\n", "\n")
    if plain.replace("\n", "").replace("\t", "").isprintable():
        return plain
    return "".join(map(_printable, plain))


def _printable(character: str) -> str:
    if character.isprintable() or character in "\n\t":
        return character
    return " " if character.isspace() else "\N{REPLACEMENT CHARACTER}"
