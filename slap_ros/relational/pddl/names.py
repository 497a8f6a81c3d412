# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which names PDDL can hold, and how they are found again: it ignores the case of letters."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Generic, TypeVar

from slap_ros.errors import MalformedPddlError, SlapError
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.pddl.sexpr import Word
from slap_ros.relational.pddl.tokens import located

OBJECT = "object"  # the type that every type descends from
UNSUPPORTED = {
    "not": "negative conditions",
    "or": "disjunctions",
    "imply": "implications",
    "forall": "quantifiers",
    "exists": "quantifiers",
    "when": "conditional effects",
    "either": "alternative types (either)",
    "preference": "preferences",
    "=": "equality and numeric fluents",
    "<": "numeric fluents",
    "<=": "numeric fluents",
    ">": "numeric fluents",
    ">=": "numeric fluents",
    "assign": "numeric fluents",
    "increase": "numeric fluents",
    "decrease": "numeric fluents",
    "scale-up": "numeric fluents",
    "scale-down": "numeric fluents",
}
RESERVED = frozenset({"and", "define", *UNSUPPORTED})
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
# Of objects and problems, which others number and date: 1st, p5.1, 2004-07-01.
_FREE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+*/@#-]*")

T = TypeVar("T")


def check_name(kind: str, name: str) -> None:
    """Refuse what is no name in PDDL.

    Raises:
        MalformedPddlError: Says what is wrong with it.
    """
    if not _NAME.fullmatch(name):
        raise MalformedPddlError(
            f"{name!r} cannot name {a_or_an(kind)} in PDDL: a letter, then letters, digits, '-' "
            "and '_'"
        )
    if name.lower() in RESERVED:
        raise MalformedPddlError(f"{name!r} cannot name {a_or_an(kind)}: PDDL reserves the word")


def check_free_name(kind: str, name: str) -> None:
    """Refuse what is no name of an object or a problem, even in files that others write.

    Raises:
        MalformedPddlError: Says what is wrong with it.
    """
    if not _FREE_NAME.fullmatch(name) or name.lower() in RESERVED:
        check_name(kind, name)


def check_new_name(kind: str, name: str, taken: set[str]) -> None:
    """Check a name and add it to those taken.

    Args:
        kind: What it names, for messages.
        name: Name to check, in upper and lower case as written.
        taken: Names in lower case; it is added to them.

    Raises:
        MalformedPddlError: It is no name, or taken up to the case of its letters.
    """
    check_name(kind, name)
    if name.lower() in taken:
        raise MalformedPddlError(
            f"two {kind}s named {name!r}: PDDL does not tell upper from lower case"
        )
    taken.add(name.lower())


def check_words(kind: str, words: Iterable[Word]) -> None:
    """Check names as they are written, no two of them alike.

    Raises:
        MalformedPddlError: With the position of the word at fault.
    """
    taken: set[str] = set()
    for word in words:
        with located(word.position):
            check_new_name(kind, word.text, taken)


def bare_variable(name: str) -> str:
    """A variable's name without its question mark.

    Raises:
        MalformedPddlError: It has none.
    """
    if not name.startswith("?"):
        raise MalformedPddlError(f"{name!r} cannot name a variable: they begin with '?'")
    return name[1:]


class Names(Generic[T]):
    """Things of one kind by name: by the very name, or by the only one that differs in case."""

    def __init__(self, kind: str, things: Mapping[str, T], error: type[SlapError]) -> None:
        """Look up names of one kind.

        Args:
            kind: What they name, for messages.
            things: What each name stands for, by name.
            error: To be raised for a name that is not among them.
        """
        self._kind = kind
        self._things = things
        self._error = error
        count = Counter(name.lower() for name in things)
        self._folded = {
            name.lower(): thing for name, thing in things.items() if count[name.lower()] == 1
        }

    def find(self, word: Word) -> T:
        """The thing that a word names.

        Raises:
            SlapError: Of the class given on construction, with the word's position.
        """
        if word.text in self._things:
            return self._things[word.text]
        if word.keyword in self._folded:
            return self._folded[word.keyword]
        known = ", ".join(sorted(self._things)) or "none"
        raise self._error(
            f"{word.position}: unknown {self._kind} {word.text!r}; known here: {known}"
        )
