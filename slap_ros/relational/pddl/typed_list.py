# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL's typed lists: ``block1 block2 - block table``, where the table has no type of its own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.pddl.names import OBJECT, bare_variable, check_words
from slap_ros.relational.pddl.sexpr import ListNode, Node, Word, expect_word
from slap_ros.relational.pddl.tokens import located


@dataclass(frozen=True)
class TypedName:
    """A name and the names of its types: several where the text has ``either``."""

    word: Word
    types: tuple[Word, ...]  # OBJECT where the text says nothing

    @property
    def is_untyped(self) -> bool:
        """Whether its type is ``object``, said or not."""
        return any(word.keyword == OBJECT for word in self.types)


def read_names(kind: str, nodes: Iterable[Node]) -> list[TypedName]:
    """A typed list of names, no two of them alike.

    Raises:
        MalformedPddlError: With the position of the word at fault.
    """
    found = read_repeated_names(kind, nodes)
    check_words(kind, (entry.word for entry in found))
    return found


def read_repeated_names(kind: str, nodes: Iterable[Node]) -> list[TypedName]:
    """A typed list of names, any of which may occur again."""
    return _read(kind, nodes)


def read_variables(nodes: Iterable[Node]) -> list[TypedName]:
    """A typed list of variables, no two of them alike.

    Raises:
        MalformedPddlError: With the position of the word at fault.
    """
    found = _read("variable", nodes)
    check_words("variable", (_bare(entry.word) for entry in found))
    return found


def read_signature(nodes: Iterable[Node]) -> list[TypedName]:
    """The variables of a declaration, where only types matter: a name may occur again.

    Raises:
        MalformedPddlError: With the position of the word at fault.
    """
    found = _read("variable", nodes)
    for entry in found:
        check_words("variable", [_bare(entry.word)])
    return found


def _bare(word: Word) -> Word:
    with located(word.position):
        return Word(bare_variable(word.text), word.position)


def _read(kind: str, nodes: Iterable[Node]) -> list[TypedName]:
    found: list[TypedName] = []
    untyped = 0  # how many at the end of `found` wait for their type
    remaining = iter(nodes)
    for node in remaining:
        word = expect_word(node, f"the name of {a_or_an(kind)}")
        if word.text != "-":
            found.append(TypedName(word, (Word(OBJECT, word.position),)))
            untyped += 1
            continue
        if not untyped:
            raise MalformedPddlError(f"{word.position}: nothing stands before '-'")
        types = _type_names(next(remaining, None), word)
        found[-untyped:] = [replace(entry, types=types) for entry in found[-untyped:]]
        untyped = 0
    return found


def _type_names(node: Node | None, dash: Word) -> tuple[Word, ...]:
    if node is None:
        raise MalformedPddlError(f"{dash.position}: the name of a type is missing after '-'")
    if isinstance(node, ListNode) and node.head == "either":
        words = tuple(expect_word(item, "the name of a type") for item in node.items[1:])
        if not words:
            raise MalformedPddlError(f"{node.position}: 'either' names no type")
        return words
    return (expect_word(node, "the name of a type"),)
