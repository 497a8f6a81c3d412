# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL text cut into parentheses and words, each with its place in the text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from slap_ros.errors import SlapError

_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")  # comments are matched so that they can be dropped


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


def tokenise(text: str, source: str) -> Iterator[Token]:
    """The tokens of a text, comments left out."""
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
