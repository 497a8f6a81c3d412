# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A server with the OpenAI-compatible interface, by way of the ``openai`` package.

Whatever the server says is data: it is bounded in size and time, checked, and freed of the key
before anything else sees it.
"""

from __future__ import annotations

import importlib
import json
import logging
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any, TypeVar

from slap_ros.errors import LanguageRefusedError, LanguageUnavailableError, SlapError
from slap_ros.files import parse_json
from slap_ros.language.failures import (
    BAD_REQUEST,
    Failure,
    address_advice,
    error_in,
    library_failure,
    status_failure,
    unreadable,
)
from slap_ros.language.keys import read_key
from slap_ros.language.request import OutputDegree, Reply, Request, replace_unprintable
from slap_ros.language.route import described_route, http_library, open_client
from slap_ros.language.settings import LanguageSettings
from slap_ros.redaction import redacted, secret_forms, without_secrets

logger = logging.getLogger(__name__)

Answer = TypeVar("Answer")

MAX_BODY_BYTES = 16_000_000
MAX_SERVER_WORDS = 300  # characters of a server's error message that are passed on
CHARACTERS_PER_TOKEN = 4  # where a server does not count
NO_KEY = "none"
SCRIPTED = "scripted"  # a server's fingerprint that says that no model answers
REFUSED = {
    200: "to answer",
    401: "the key",
    403: "the key, or what it is asked for",
    404: "the model or the address",
    407: "what the proxy passed on",
}


class OpenAIClient:
    """Asks a server; again, after growing pauses, where it is busy or gone."""

    def __init__(
        self, settings: LanguageSettings, environment: Mapping[str, str] | None = None
    ) -> None:
        """Prepare to ask; nothing is sent yet.

        Args:
            settings: Which model, where, how.
            environment: Where the key is; the process's own if left out.

        Raises:
            LanguageUnavailableError: No model is named, no key is there where one must be, no
                header can hold it, the proxy cannot be used, or the ``openai`` package is missing.
        """
        if not settings.model:
            raise LanguageUnavailableError(
                "no language model is named; give --model or set SLAP_LANGUAGE_MODEL"
            )
        key = read_key(settings, os.environ if environment is None else environment)
        self._openai = _import_openai()
        self._http = http_library(self._openai)
        self._settings = settings
        self._secrets = secret_forms(key)
        self._route = described_route(settings.base_url)
        self._degree = settings.degree
        self._client = open_client(self._openai, settings.base_url, key or NO_KEY)

    @property
    def source(self) -> str:
        """The server's address; settings refuse one with anything secret in it."""
        return self._settings.base_url

    @property
    def degree(self) -> OutputDegree:
        """To which degree this server is asked for structure by now."""
        return self._degree

    def close(self) -> None:
        """Close the connections to the server."""
        self._client.close()

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request; see :class:`~.request.Client`.

        Raises:
            LanguageRefusedError: The server refuses the request in every form of output.
        """
        began = time.monotonic()
        deadline = began + min(seconds_left, self._settings.answer_seconds)
        degree: OutputDegree | None = self._degree
        refusals: list[str] = []
        while degree is not None:
            body = self._body(request, degree)
            outcome = self._ask(self._client.chat.completions, body, _read_envelope, deadline)
            if isinstance(outcome, Failure):
                refusals.append(f"{degree}: {outcome.words}")
                degree = degree.next
                continue
            self._remember(degree, refusals)
            return self._reply(outcome, request, degree, time.monotonic() - began)
        raise LanguageRefusedError(
            f"{self.source} does not accept the request, however it is asked: {refusals[-1]}"
        )

    def embed(self, texts: Sequence[str], seconds_left: float) -> list[list[float]]:
        """The vectors of texts, by the server's ``/embeddings``.

        Args:
            texts: One or more.
            seconds_left: The wait ends then.

        Returns:
            As many vectors as texts, in their order, all of the same size.

        Raises:
            LanguageUnavailableError: No answer could be had.
            LanguageRefusedError: The server does not accept the request: key, model, address.
        """
        deadline = time.monotonic() + min(seconds_left, self._settings.answer_seconds)
        body = {"model": self._settings.model, "input": [*texts], "encoding_format": "float"}
        read = partial(_read_embeddings, count=len(texts))
        outcome = self._ask(self._client.embeddings, body, read, deadline)
        if isinstance(outcome, Failure):
            raise LanguageRefusedError(
                f"{self.source} makes no embeddings (model {self._settings.model!r}): "
                f"{outcome.words}"
            )
        return outcome

    def _remember(self, degree: OutputDegree, refusals: list[str]) -> None:
        if degree != self._degree:
            logger.warning(
                "%s refused %s; from now on it is asked for %s",
                self.source, "; ".join(refusals), degree,
            )  # fmt: skip
            self._degree = degree

    def _ask(
        self,
        endpoint: Any,
        body: dict[str, Any],
        read: Callable[[bytes], Answer | Failure],
        deadline: float,
    ) -> Answer | Failure:
        """The server's answer; a failure only where it does not accept the request as such.

        Args:
            endpoint: Endpoint of the ``openai`` package's client.
            body: What is sent there.
            read: Makes of the bytes that come back what is returned.
            deadline: On the clock of :func:`time.monotonic`, s.
        """
        failures = 0
        while True:
            outcome = self._try(endpoint, body, read, deadline - time.monotonic())
            if not isinstance(outcome, Failure) or outcome.status in BAD_REQUEST:
                return outcome
            failures += 1
            if not outcome.passing:
                raise self._refusal(outcome, body["model"])
            self._wait(outcome, failures, deadline)

    def _refusal(self, failure: Failure, model: str) -> SlapError:
        """The error for what cannot be otherwise the next time."""
        if failure.status is None:
            return LanguageUnavailableError(
                f"no answer from {self.source}{self._route}: {failure.words}"
            )
        at_fault = REFUSED.get(failure.status, "the request")
        advice = address_advice(self.source) if failure.misplaced else ""
        return LanguageRefusedError(
            f"{self.source}{self._route} refused {at_fault} (model {model!r}): "
            f"{failure.words}{advice}"
        )

    def _wait(self, failure: Failure, failures: int, deadline: float) -> None:
        retry = self._settings.retry
        pause = max(retry.pause(failures), failure.retry_after or 0.0)
        left = deadline - time.monotonic()
        if failures >= retry.tries or pause >= left:
            raise LanguageUnavailableError(
                f"no answer from {self.source}{self._route} (tried {failures} times): "
                f"{failure.words}; {max(left, 0.0):.0f} s were left to wait"
                + (f", and it asked for {pause:.0f} s" if failure.retry_after else "")
            )
        logger.info("%s: %s; asking again in %.1f s", self.source, failure.words, pause)
        time.sleep(pause)

    def _try(
        self,
        endpoint: Any,
        body: dict[str, Any],
        read: Callable[[bytes], Answer | Failure],
        seconds: float,
    ) -> Answer | Failure:
        """The same, once; see :meth:`_ask`, which gives it so many seconds."""
        if seconds <= 0:
            return Failure("the time for an answer is over")
        try:
            received = self._receive(endpoint, body, seconds)
        except self._openai.APIStatusError as error:
            received = status_failure(error.status_code, error.body, error.response.headers)
        except Exception as error:  # the library's and those below it, of whatever kinds
            received = library_failure(error, self._openai, self._http)
        outcome = received if isinstance(received, Failure) else read(received)
        if isinstance(outcome, Failure):
            return replace(outcome, words=self._clean(outcome.words))
        return outcome

    def _receive(self, endpoint: Any, fields: dict[str, Any], seconds: float) -> bytes | Failure:
        """The answer's bytes; as they come, since a time limit for each says nothing about all."""
        deadline = time.monotonic() + seconds
        parts, size = [], 0
        streaming = endpoint.with_streaming_response
        with _quiet(), streaming.create(**fields, timeout=seconds) as response:
            for part in response.iter_bytes():
                size += len(part)
                if size > MAX_BODY_BYTES:
                    return Failure(
                        f"an answer of more than {MAX_BODY_BYTES} bytes", 200, lasting=True
                    )
                if time.monotonic() > deadline:
                    raise TimeoutError("the answer came too slowly")
                parts.append(part)
        return b"".join(parts)

    def _body(self, request: Request, degree: OutputDegree) -> dict[str, Any]:
        messages = [{"role": m.role, "content": m.content} for m in request.messages]
        schema = request.schema
        body: dict[str, Any] = {"model": request.model, "messages": messages}
        if degree is OutputDegree.JSON_SCHEMA:
            described = {"name": schema.name, "strict": True, "schema": schema.definition}
            body["response_format"] = {"type": "json_schema", "json_schema": described}
        elif degree is OutputDegree.JSON_OBJECT:
            body["response_format"] = {"type": "json_object"}
            messages[-1]["content"] += (
                "\n\nAnswer with one JSON object and nothing else. It must conform to this JSON "
                f"schema:\n{json.dumps(schema.definition)}"
            )
        else:
            messages[-1]["content"] += f"\n\n{schema.text_format}"
        # After the package's own checks of arguments, so that any server's fields will do.
        return body | {"extra_body": dict(request.sampling)}

    def _reply(
        self, envelope: dict[str, Any], request: Request, degree: OutputDegree, seconds: float
    ) -> Reply:
        choice = envelope["choices"][0]
        message = choice["message"]
        text = self._redact(replace_unprintable(_text(message.get("content"))))
        refusal = message.get("refusal")
        asked = sum(len(m.content) for m in request.messages)
        return Reply(
            text,
            self._clean(refusal) if isinstance(refusal, str) and refusal else None,
            self._clean(str(choice.get("finish_reason"))),
            _count(envelope, "prompt_tokens", asked),
            _count(envelope, "completion_tokens", len(text)),
            self._clean(str(envelope.get("model", request.model))),
            degree,
            round(seconds, 3),
            envelope.get("system_fingerprint") == SCRIPTED,
        )

    def _redact(self, text: str) -> str:
        """Text without the key, which some servers repeat in their messages."""
        return redacted(text, self._secrets)

    def _clean(self, text: str) -> str:
        """A server's words for logs and errors: short, on one line, without the key."""
        whole = without_secrets(self._redact(text))
        line = " ".join(replace_unprintable(whole).split())
        return line if len(line) <= MAX_SERVER_WORDS else f"{line[:MAX_SERVER_WORDS]}…"


def _import_openai() -> ModuleType:
    try:
        return importlib.import_module("openai")
    except ImportError as error:
        raise LanguageUnavailableError(
            "asking a language model takes the openai package: pip install -e '.[language]'"
        ) from error


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the package's own debugging lines, which may show a request's headers."""
    names = ("openai", "httpx", "httpx2", "httpcore", "httpcore2")
    loggers = [logging.getLogger(name) for name in names]
    levels = [entry.level for entry in loggers]
    for entry in loggers:
        entry.setLevel(max(entry.level, logging.WARNING))
    try:
        yield
    finally:
        for entry, level in zip(loggers, levels, strict=True):
            entry.setLevel(level)


def _read_envelope(body: bytes) -> dict[str, Any] | Failure:
    """The server's JSON around the answer, as far as it is needed."""
    try:
        envelope = parse_json(body)
        message = envelope["choices"][0]["message"]
        if not isinstance(message, dict):
            raise TypeError("no message")
    except (ValueError, TypeError, KeyError, IndexError):
        return unreadable(body, "chat completion")
    return error_in(envelope) or dict(envelope)


def _read_embeddings(body: bytes, count: int) -> list[list[float]] | Failure:
    """The vectors in a server's answer, in the order in which texts were sent."""
    try:
        data = sorted(parse_json(body)["data"], key=lambda one: int(one["index"]))
        vectors = [[float(number) for number in one["embedding"]] for one in data]
        sizes = {len(vector) for vector in vectors}
        if len(vectors) != count or len(sizes) != 1 or 0 in sizes:
            raise ValueError("other vectors than were asked for")
        if not all(math.isfinite(number) for vector in vectors for number in vector):
            raise ValueError("not all numbers")
    except (ValueError, TypeError, KeyError, OverflowError):
        return unreadable(body, f"{count} embeddings")
    return vectors


def _text(content: Any) -> str:
    """The answer's text; some servers give it in parts."""
    if isinstance(content, list):
        parts = (part.get("text") for part in content if isinstance(part, dict))
        return "".join(part for part in parts if isinstance(part, str))
    return content if isinstance(content, str) else ""


def _count(envelope: dict[str, Any], name: str, characters: int) -> int:
    usage = envelope.get("usage")
    count = usage.get(name) if isinstance(usage, dict) else None
    if isinstance(count, int) and not isinstance(count, bool) and count >= 0:
        return count
    return -(-characters // CHARACTERS_PER_TOKEN)
