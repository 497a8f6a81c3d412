# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Texts freed of secrets before anybody sees or stores them.

A secret is known by where it is kept: in an environment variable whose name says so, or as the
password in the address of a proxy. Messages of exceptions and tracebacks may have it in them,
whole, in part or as Python writes it.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from urllib.parse import quote, urlsplit

HIDDEN = "[key]"
SHORTEST_SECRET = 8  # characters; shorter ones are placeholders, and parts of other words
_SECRET_NAME = re.compile(r"(^|_)(KEY|TOKEN|SECRET|PASSWORD)$", re.IGNORECASE)
_PROXY_NAME = re.compile(r"(^|_)PROXY$", re.IGNORECASE)
_PART = re.compile(rf"[A-Za-z0-9._~+/=-]{{{SHORTEST_SECRET},}}")  # what keys are made of (RFC 6750)
_CREDENTIALS = re.compile(r"\b(Bearer|Basic) +[^\s'\",;]+")


def secret_forms(secret: str) -> frozenset[str]:
    """The forms in which a secret may stand in a text.

    Args:
        secret: A key or a password, with whatever came along by copying: quotes, blanks, line ends.

    Returns:
        It as it is and as it is escaped in Python, JSON and addresses, and its longer parts.
        Nothing for one that is too short to be a secret.
    """
    if len(secret.strip()) < SHORTEST_SECRET:
        return frozenset()
    escaped = (repr(secret)[1:-1], ascii(secret)[1:-1], json.dumps(secret)[1:-1])
    return frozenset(
        (secret, *escaped, quote(secret, safe="", errors="replace"), *_PART.findall(secret))
    )


def redacted(text: str, secrets: Iterable[str]) -> str:
    """A text in which these secrets are replaced, the longest ones first."""
    for secret in sorted(secrets, key=len, reverse=True):
        text = text.replace(secret, HIDDEN)
    return text


def without_secrets(text: str, environment: Mapping[str, str] | None = None) -> str:
    """A text without the secrets of the environment, and without what authorizes a request.

    Args:
        text: A message or a traceback.
        environment: The variables; the process's own if left out.
    """
    variables = os.environ if environment is None else environment
    forms: set[str] = set()
    for name, value in variables.items():
        forms |= secret_forms(_secret_in(name, value))
    return _CREDENTIALS.sub(rf"\1 {HIDDEN}", redacted(text, forms))


def _secret_in(name: str, value: str) -> str:
    """The secret that a variable has; empty for most."""
    if _SECRET_NAME.search(name):
        return value
    if not _PROXY_NAME.search(name):
        return ""
    try:
        return urlsplit(value if "://" in value else f"//{value}").password or ""
    except ValueError:  # no address: all of it may be secret
        return value
