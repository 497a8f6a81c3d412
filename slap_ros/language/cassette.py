# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded exchanges, so that a run can be repeated to the byte without a model.

A cassette is a file of JSON lines: a header, which says what answered and when, then a line for
each exchange with the request, the reply and the sha256 of both. A request that was asked several
times is answered in the order of the recording. Nothing in it is secret: keys are in no request.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

from slap_ros.errors import (
    CassetteMissError,
    InvalidCassetteError,
    InvalidParameterError,
    LanguageOffError,
    StorageFullError,
)
from slap_ros.files import parse_json, read_bytes, reason_of
from slap_ros.language.asking import AskingClient
from slap_ros.language.client import OpenAIClient
from slap_ros.language.local import LocalClient
from slap_ros.language.request import Client, Message, OutputDegree, Reply, Request, Schema
from slap_ros.language.settings import (
    BY_HAND,
    FOLDER_SCHEME,
    LOCAL_SCHEME,
    LanguageSettings,
    asked_by_hand,
)

FORMAT = "slap_ros language cassette"
VERSION = 1
MODES = "live, off, record:FILE or replay:FILE"
SHOWN = 60  # characters around a difference


def make_client(settings: LanguageSettings) -> Client:
    """The client of a server, of a model in this process, or of whoever a person asks.

    Raises:
        LanguageUnavailableError: It cannot be asked; the message says what is missing.
        InvalidParameterError: A folder for a person, and a model that is not asked by hand.
    """
    if asked_by_hand(settings.model) is not None:
        return AskingClient(settings)
    if settings.base_url.startswith(FOLDER_SCHEME):
        raise InvalidParameterError(
            f"--base-url {settings.base_url} is for --model {BY_HAND}:NAME, which a person asks"
        )
    local = settings.base_url.startswith(LOCAL_SCHEME)
    return LocalClient(settings) if local else OpenAIClient(settings)


def open_client(cassette: str, settings: LanguageSettings) -> Client:
    """The client that answers, by the mode of the cassette.

    Args:
        cassette: ``live``, ``off``, ``record:FILE`` or ``replay:FILE``.
        settings: Which model, where, how; replay and ``off`` need none.

    Raises:
        InvalidParameterError: Another mode.
        InvalidCassetteError: Not a cassette, or a file to be recorded that exists.
        LanguageUnavailableError: A server cannot be asked.
    """
    mode, _, path = cassette.partition(":")
    if mode in ("live", "off") and not path:
        return make_client(settings) if mode == "live" else OffClient()
    if mode == "replay" and path:
        return ReplayingClient(read_cassette(Path(path)))
    if mode == "record" and path:
        _refuse_existing(Path(path))
        return RecordingClient(make_client(settings), Path(path))
    raise InvalidParameterError(f"--cassette {cassette!r}: it is {MODES}")


@dataclass(frozen=True)
class Exchange:
    """A request and what came back."""

    request: Request
    reply: Reply


@dataclass(frozen=True)
class Cassette:
    """A recording as it is read.

    Args:
        path: Where it was read.
        digest: The file's sha256, in hexadecimal.
        source: What answered.
        recorded: When it began, ISO 8601.
        exchanges: In order.
    """

    path: Path
    digest: str
    source: str
    recorded: str
    exchanges: tuple[Exchange, ...]

    @property
    def from_a_model(self) -> bool:
        """Whether a live server with a model answered throughout, as far as it says itself."""
        return bool(self.exchanges) and not any(e.reply.scripted for e in self.exchanges)


class OffClient:
    """Refuses every call."""

    source = "off"

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """Refuse every request.

        Raises:
            LanguageOffError: Always.
        """
        del seconds_left
        raise LanguageOffError(
            f"a language model ({request.model or 'unnamed'}) was to be asked, but --cassette is "
            "off; use live, record:FILE or replay:FILE, or another proposer"
        )


class RecordingClient:
    """Asks another client, and writes down each exchange as soon as it is there."""

    def __init__(self, client: Client, path: Path) -> None:
        """Record to a file that does not exist yet.

        Args:
            client: Whoever answers.
            path: The cassette.

        Raises:
            InvalidCassetteError: It exists.
            StorageFullError: It cannot be written.
        """
        _refuse_existing(path)
        self._client = client
        self._path = path
        header = {
            "format": FORMAT,
            "version": VERSION,
            "source": client.source,
            "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        self._write(header, "x")

    @property
    def source(self) -> str:
        """The model or server that answers."""
        return self._client.source

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request; see :class:`~.request.Client`."""
        reply = self._client.complete(request, seconds_left)
        line = {
            "sha256": request.digest,
            "request": json.loads(request.canonical),
            "reply": asdict(reply),
            "reply_sha256": _digest(asdict(reply)),
        }
        self._write(line, "a")
        return reply

    def _write(self, line: Mapping[str, Any], mode: str) -> None:
        try:
            if mode == "x":
                self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open(mode, encoding="utf-8") as file:
                file.write(json.dumps(line, sort_keys=True, allow_nan=False) + "\n")
        except OSError as error:
            raise StorageFullError(f"cannot record to {self._path}: {error.strerror}") from error


def with_recorded(settings: LanguageSettings, client: Client) -> LanguageSettings:
    """Settings whose model and sampling are the recorded ones, where replay is given no model."""
    if settings.model or not isinstance(client, ReplayingClient) or not client.cassette.exchanges:
        return settings
    first = client.cassette.exchanges[0].request
    return replace(settings, model=first.model, sampling=first.sampling)


class ReplayingClient:
    """Answers from a cassette alone."""

    def __init__(self, cassette: Cassette) -> None:
        """Begin with the first recorded answer to each request."""
        self.cassette = cassette
        self._answers: dict[str, list[Reply]] = {}
        for exchange in cassette.exchanges:
            self._answers.setdefault(exchange.request.digest, []).append(exchange.reply)
        self._asked: dict[str, int] = {}

    @property
    def source(self) -> str:
        """What answered when it was recorded."""
        return self.cassette.source

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The recorded answer.

        Raises:
            CassetteMissError: There is none, with the nearest request and where they differ.
        """
        del seconds_left  # recorded answers are there at once
        answers = self._answers.get(request.digest, [])
        asked = self._asked.get(request.digest, 0)
        self._asked[request.digest] = asked + 1
        if asked < len(answers):
            return answers[asked]
        if answers:
            raise CassetteMissError(
                f"{self.cassette.path}: this request was recorded {len(answers)} times and is "
                f"asked once more (sha256 {request.digest[:12]}…); record it again"
            )
        raise CassetteMissError(
            f"{self.cassette.path} has no answer to this request (sha256 {request.digest[:12]}…): "
            f"{_nearest(request, self.cassette)}; record it again, or use the settings and the "
            "version that recorded it"
        )


def read_cassette(path: Path) -> Cassette:
    """Read a recording.

    Raises:
        InvalidCassetteError: It cannot be read, is none, is cut, or was changed by hand.
    """
    try:
        data = read_bytes(path)
        lines = data.decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidCassetteError(f"cannot read cassette {path}: {reason_of(error)}") from error
    header = _read_line(path, 1, lines[0]) if lines else {}
    if header.get("format") != FORMAT:
        raise InvalidCassetteError(f"{path} is no recording of a language model")
    if header.get("version") != VERSION:
        raise InvalidCassetteError(
            f"{path} is a recording of version {header.get('version')!r}; this is {VERSION}"
        )
    exchanges = tuple(_exchange(path, i, line) for i, line in enumerate(lines[1:], start=2))
    return Cassette(
        path,
        sha256(data).hexdigest(),
        str(header.get("source")),
        str(header.get("recorded")),
        exchanges,
    )


def _refuse_existing(path: Path) -> None:
    if path.exists():
        raise InvalidCassetteError(
            f"{path} exists; replay it, or record to another file: recordings are never added to"
        )


def _read_line(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        entry = parse_json(line)
    except ValueError as error:
        raise InvalidCassetteError(
            f"{path}, line {number}: no JSON ({error}); if the recording was interrupted there, "
            "delete the line"
        ) from error
    if not isinstance(entry, dict):
        raise InvalidCassetteError(f"{path}, line {number}: not an object")
    return entry


def _exchange(path: Path, number: int, line: str) -> Exchange:
    entry = _read_line(path, number, line)
    try:
        asked, answered = entry["request"], dict(entry["reply"])
        request = Request(
            asked["model"],
            tuple(Message(m["role"], m["content"]) for m in asked["messages"]),
            Schema(**asked["schema"]),
            asked["sampling"],
        )
        answered["degree"] = OutputDegree(answered["degree"])
        reply = Reply(**answered)
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidCassetteError(
            f"{path}, line {number}: no exchange with a language model ({error!r})"
        ) from error
    _check_reply(path, number, reply)
    if request.digest != entry.get("sha256") or _digest(entry["reply"]) != entry.get(
        "reply_sha256"
    ):
        raise InvalidCassetteError(
            f"{path}, line {number}: not as it was recorded: its sha256 is another; record it again"
        )
    return Exchange(request, reply)


def _digest(reply: Mapping[str, Any]) -> str:
    return sha256(json.dumps(reply, sort_keys=True).encode()).hexdigest()


def _check_reply(path: Path, number: int, reply: Reply) -> None:
    """Types as they were written; a number of another kind would go unnoticed until it counts."""
    for entry in fields(reply):
        value = getattr(reply, entry.name)
        wanted: tuple[type, ...] = {
            "refusal": (str, type(None)),
            "prompt_tokens": (int,),
            "completion_tokens": (int,),
            "seconds": (int, float),
            "scripted": (bool,),
        }.get(entry.name, (str,))
        if not isinstance(value, wanted):
            raise InvalidCassetteError(
                f"{path}, line {number}: {entry.name} of the reply is {value!r}"
            )


def _nearest(request: Request, cassette: Cassette) -> str:
    """Which recorded request is most like this one, and where they first differ."""
    if not cassette.exchanges:
        return "it has no exchanges at all"
    wanted = request.canonical

    def likeness(exchange: Exchange) -> tuple[int, int]:
        recorded = exchange.request.canonical
        return _common_prefix(wanted, recorded), -abs(len(wanted) - len(recorded))

    number, nearest = max(enumerate(cassette.exchanges, start=1), key=lambda e: likeness(e[1]))
    difference = _difference(nearest.request, request)
    return f"the nearest is exchange {number}, which differs in {difference}"


def _difference(recorded: Request, asked: Request) -> str:
    """Where two requests differ, for people."""
    if recorded.model != asked.model:
        return f"the model: recorded {recorded.model!r}, asked {asked.model!r}"
    if dict(recorded.sampling) != dict(asked.sampling):
        return f"sampling: recorded {dict(recorded.sampling)}, asked {dict(asked.sampling)}"
    if recorded.schema != asked.schema:
        return f"the schema ({recorded.schema.name} and {asked.schema.name})"
    counts = len(recorded.messages), len(asked.messages)
    if counts[0] != counts[1]:
        return f"the number of messages: recorded {counts[0]}, asked {counts[1]}"
    for i, (old, new) in enumerate(zip(recorded.messages, asked.messages, strict=True), start=1):
        if old != new:
            at = _common_prefix(old.content, new.content)
            begin = max(0, at - SHOWN // 2)
            return (
                f"message {i} at character {at}: recorded {old.content[begin : at + SHOWN]!r}, "
                f"asked {new.content[begin : at + SHOWN]!r}"
            )
    return "nothing that is shown"


def _common_prefix(one: str, other: str) -> int:
    """How many characters two texts have in common at their beginning."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[:middle] == other[:middle]:
            low = middle
        else:
            high = middle - 1
    return low
