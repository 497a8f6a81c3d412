# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL text cut into parentheses and words, each with its place in the text."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from slap_ros.errors import SlapError

# Comments are matched so that they can be dropped. A variable, a keyword and a dash before the name
# of a type begin a token wherever they stand: people write (edge ?a?b), (:requirements:strips) and
# ?x -block.
_TOKEN = re.compile(r";[^\n]*|[()]|:[^\s();?:]*|-(?=[A-Za-z])|\??[^\s();?]+|\?")


@dataclass(frozen=True)
class Position:
    """A place in a text; lines and columns count from 1."""

    source: str  # where the text comes from, for people
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Token:
    """A parenthesis or a word."""

    text: str
    position: Position


def decode(data: bytes) -> str:
    """The text of a file, in whichever encoding it was written.

    A byte-order mark says which one; without it, text that is no UTF-8 is Latin-1, in which every
    byte is a letter: outside comments, what is no ASCII is refused later, with its place.

    Args:
        data: Content of the file.

    Returns:
        The text, its lines ended by line feeds.

    Raises:
        UnicodeDecodeError: It does not have the encoding that its byte-order mark says.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            if data.startswith(codecs.BOM_UTF8):
                raise
            text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def tokenise(text: str, source: str) -> Iterator[Token]:
    """The tokens of a text, comments and a byte-order mark left out."""
    text = text.removeprefix("\ufeff")
    for number, line in enumerate(text.split("\n"), start=1):
        for match in _TOKEN.finditer(line):
            if not match[0].startswith(";"):
                yield Token(match[0], Position(source, number, match.start() + 1))


@contextmanager
def located(position: Position) -> Iterator[None]:
    """Put a position in front of what goes wrong inside.

    Raises:
        SlapError: What was raised inside, of the same class.
    """
    try:
        yield
    except SlapError as error:
        raise type(error)(f"{position}: {error}") from error
