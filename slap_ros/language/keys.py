# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The key of a server: from the environment, checked before anything is sent, never shown."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Mapping

from slap_ros.errors import LanguageUnavailableError
from slap_ros.language.settings import KEY_VARIABLE, OPENAI_URL, LanguageSettings
from slap_ros.redaction import secret_forms

FIRST_VISIBLE, LAST_VISIBLE = "!", "~"  # ASCII, without blanks: what a header takes unchanged
SHORTEST_KEY = 16  # characters; shorter ones are placeholders, such as a server's own name


def read_key(settings: LanguageSettings, environment: Mapping[str, str]) -> str:
    """The key that a server is given; empty for servers that want none.

    Args:
        settings: Which server is asked; they are written to logs and recordings.
        environment: Where the key is.

    Raises:
        LanguageUnavailableError: There is no key where one must be, no header can hold it, or it
            stands in the settings as well.
    """
    key = environment.get(KEY_VARIABLE, "")
    if not key and settings.base_url == OPENAI_URL:
        raise LanguageUnavailableError(
            f"{OPENAI_URL} wants a key: set {KEY_VARIABLE}, or name another server by "
            "--base-url (docs/language.md has recipes for local ones)"
        )
    _require_header(key)
    _require_hidden(key, settings)
    return key


def _require_header(key: str) -> None:
    for at, character in enumerate(key):
        if not FIRST_VISIBLE <= character <= LAST_VISIBLE:
            where = "begins with" if at == 0 else "ends with" if at == len(key) - 1 else "has"
            raise LanguageUnavailableError(
                f"the key in {KEY_VARIABLE} {where} {_named(character)}, which no header of a "
                "request can hold; nothing was sent. Copy the key again, without quotes, blanks "
                "and line ends"
            )


def _named(character: str) -> str:
    """A character in words; it may be one that cannot be printed."""
    known = {"\n": "a line end", "\r": "a carriage return", "\t": "a tab", " ": "a blank"}
    if 0xDC80 <= ord(character) <= 0xDCFF:  # how Python keeps bytes that are no text
        return f"the byte 0x{ord(character) - 0xDC00:02X}, which is no UTF-8"
    name = unicodedata.name(character, "a control character").lower()
    return known.get(character, f"U+{ord(character):04X} ({name})")


def _require_hidden(key: str, settings: LanguageSettings) -> None:
    if len(key) < SHORTEST_KEY:
        return
    texts = {
        "name of the model": settings.model,
        "base URL": settings.base_url,
        "sampling": json.dumps(dict(settings.sampling)),
    }
    for name, text in texts.items():
        if any(form in text for form in secret_forms(key)):
            raise LanguageUnavailableError(
                f"the key of {KEY_VARIABLE} stands in the {name} as well, which is written to "
                "logs and recordings: take it out there"
            )
