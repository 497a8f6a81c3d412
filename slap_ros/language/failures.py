# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why a server gave no answer, in its own words, and whether asking again can help.

Servers say so in many ways: by an HTTP status; by an ``error`` within a 200; by a web page, where
the address is another one; by a stream that nobody asked for.
"""

from __future__ import annotations

import re
import socket
import ssl
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from html import unescape
from types import ModuleType
from typing import Any
from urllib.parse import urlsplit

from slap_ros.files import parse_json

BAD_REQUEST = (400, 422)
BUSY = (408, 409, 425, 429)
ELSEWHERE = (301, 302, 303, 307, 308, 404, 405)  # as servers answer at other addresses
ENDPOINTS = ("/chat/completions", "/completions", "/embeddings", "/responses", "/models")
# Kinds of errors by the names that servers give them, where no status comes along.
PASSING_KINDS = frozenset(
    {"server_error", "rate_limit_exceeded", "rate_limit_error", "overloaded_error", "timeout"}
)
LASTING_KINDS = frozenset({"insufficient_quota"})  # whatever the status says
# Why TLS cannot begin, as OpenSSL names it: the other side speaks plain HTTP.
PLAIN_HTTP = ("WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE", "HTTP_REQUEST")
_STATUS = re.compile(r"[45][0-9][0-9]")
_TITLE = re.compile(r"<title[^>]*>([^<]*)", re.IGNORECASE)
_STREAM = re.compile(rb"\s*(data|event|id|retry)?:")
_DATA = re.compile(rb"^data:(.*)$", re.MULTILINE)
MAX_CHUNKS = 64  # of a stream, looked at for an error


@dataclass(frozen=True)
class Failure:
    """Why a try gave no answer.

    Args:
        words: What the server or the network said.
        status: HTTP status, also one that is named within a 200; None where nothing that can be
            understood came back.
        retry_after: Pause that the server asks for, s.
        lasting: Whether asking again cannot help, whatever the status says.
        misplaced: Whether the base URL may be the reason.
    """

    words: str
    status: int | None = None
    retry_after: float | None = None
    lasting: bool = False
    misplaced: bool = False

    @property
    def passing(self) -> bool:
        """Whether it may be otherwise the next time."""
        if self.lasting:
            return False
        return self.status is None or self.status in BUSY or self.status >= 500


def status_failure(status: int, body: object, headers: Mapping[str, str]) -> Failure:
    """The failure of an answer whose HTTP status is no success.

    Args:
        status: The status.
        body: The answer's JSON, or its text.
        headers: The answer's.
    """
    words = server_words(body)
    return Failure(
        f"HTTP {status}: {words}",
        status,
        retry_after(headers),
        lasting=not LASTING_KINDS.isdisjoint(_kinds(body)),
        misplaced=status in ELSEWHERE and "model" not in words.lower(),
    )


def library_failure(error: Exception, openai: ModuleType, http: ModuleType) -> Failure:
    """The failure of a connection, or of whatever else a library raises while it asks.

    Args:
        error: What was raised.
        openai: The library that was called.
        http: The HTTP library below it.
    """
    lost = (openai.APIConnectionError, openai.APIResponseValidationError, http.HTTPError)
    causes = list(_causes(error))
    words = f"{type(error).__name__}: {error}"
    if causes[-1] is not error:
        words += f" ({type(causes[-1]).__name__}: {causes[-1]})"
    lasting = any(_is_lasting(cause, http) for cause in causes)
    return Failure(words, lasting=lasting or not isinstance(error, (TimeoutError, *lost)))


def unreadable(body: bytes, wanted: str) -> Failure:
    """The failure of an answer with a status of success that is not what was wanted.

    Args:
        body: The answer.
        wanted: What it should have been, in words.
    """
    if body.lstrip()[:1] == b"<":
        words = f"a web page, {server_words(_text(body))}"
        return Failure(words, 200, lasting=True, misplaced=True)
    if _STREAM.match(body):
        return _stream_failure(body)
    try:
        error = error_in(parse_json(body))
    except ValueError:
        error = None
    return error or Failure(f"an answer of {len(body)} bytes that is no {wanted}")


def error_in(data: Any) -> Failure | None:
    """The error that a server wrote into an answer with a status of success; None without one.

    Args:
        data: The answer's JSON.
    """
    data = data[0] if isinstance(data, list) and data else data
    found = data if _has_error(data) else _choice(data)
    if not _has_error(found):
        return None
    kinds = _kinds(found)
    codes = [int(kind) for kind in sorted(kinds) if _STATUS.fullmatch(kind)]
    words = f"HTTP 200 with an error{f' {codes[0]}' if codes else ''}: {server_words(found)}"
    if codes:
        spent = not LASTING_KINDS.isdisjoint(kinds)
        return Failure(words, codes[0], lasting=spent, misplaced=codes[0] in ELSEWHERE)
    if not PASSING_KINDS.isdisjoint(kinds):
        return Failure(words)
    return Failure(words, 200, lasting=True, misplaced=True)


def server_words(body: object) -> str:
    """The message within a server's error, however it is wrapped."""
    for _ in range(4):
        if isinstance(body, list) and body:
            body = body[0]
        if not isinstance(body, dict):
            break
        body = body.get("error") or body.get("message") or body.get("detail") or str(body)
    text = str(body) if body else "no explanation"
    if not text.lstrip().startswith("<"):
        return text
    title = _TITLE.search(text)
    return repr(unescape(title[1]).strip()) if title and title[1].strip() else "without a title"


def address_advice(base_url: str) -> str:
    """What to change at a base URL that is likely to be wrong; empty where it looks right."""
    path = urlsplit(base_url).path.rstrip("/")
    for endpoint in ENDPOINTS:
        if path.endswith(endpoint):
            return f"; leave {endpoint} off the base URL, it is added for each request"
    if re.search(r"/v\d", path):
        return ""
    return f"; add /v1 to the base URL: {base_url.rstrip('/')}/v1"


def retry_after(headers: Mapping[str, str]) -> float | None:
    """Seconds that a server asks to wait, given as a number or as a date."""
    value = headers.get("retry-after", "")
    try:
        return max(0.0, float(value))
    except ValueError:
        pass
    try:
        moment = parsedate_to_datetime(value)
    except ValueError:
        return None
    aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return max(0.0, (aware - datetime.now(UTC)).total_seconds())


def _stream_failure(body: bytes) -> Failure:
    for match, _ in zip(_DATA.finditer(body), range(MAX_CHUNKS), strict=False):
        try:
            error = error_in(parse_json(match[1]))
        except ValueError:
            continue
        if error is not None:
            return error
    return Failure(
        "a stream, though none was asked for: switch streaming off at the server, or at what is "
        "between",
        200,
        lasting=True,
    )


def _has_error(data: object) -> bool:
    return isinstance(data, dict) and bool(data.get("error"))


def _choice(data: object) -> object:
    """The first choice of a completion: an error may be there as well."""
    choices = data.get("choices") if isinstance(data, dict) else None
    return choices[0] if isinstance(choices, list) and choices else None


def _kinds(body: object) -> frozenset[str]:
    """Codes and types that an error has, as texts."""
    if isinstance(body, dict) and isinstance(body.get("error"), dict):
        body = body["error"]
    found = (body.get(name) for name in ("code", "type")) if isinstance(body, dict) else ()
    return frozenset(str(kind) for kind in found if isinstance(kind, str | int))


def _causes(error: BaseException) -> Iterator[BaseException]:
    """What was raised, and why, and why that was."""
    seen: set[int] = set()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        seen.add(id(cause))
        yield cause
        cause = cause.__cause__ or (None if cause.__suppress_context__ else cause.__context__)


def _is_lasting(cause: BaseException, http: ModuleType) -> bool:
    """Whether asking again ends in the same way: a wrong name, certificate, address or header."""
    if isinstance(cause, socket.gaierror):
        return cause.errno == socket.EAI_NONAME
    if isinstance(cause, ssl.SSLError):
        return isinstance(cause, ssl.SSLCertVerificationError) or cause.reason in PLAIN_HTTP
    kinds = (http.UnsupportedProtocol, http.LocalProtocolError, http.InvalidURL)
    return isinstance(cause, (UnicodeError, ImportError, *kinds))


def _text(body: bytes) -> str:
    return body.decode("utf-8", "replace")
