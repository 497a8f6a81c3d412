# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Conjunctions of atoms: preconditions, effects and goals before their names are looked up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.pddl.names import UNSUPPORTED
from slap_ros.relational.pddl.sexpr import ListNode, Node, Word, expect_list, expect_word
from slap_ros.relational.pddl.tokens import Position


@dataclass(frozen=True)
class Formula:
    """An atom as it is written: the names of a predicate and of its arguments."""

    predicate: Word
    arguments: tuple[Word, ...]

    @property
    def position(self) -> Position:
        """Where it is written."""
        return self.predicate.position


def read_formula(node: Node) -> Formula:
    """The atom that a node consists of.

    Raises:
        MalformedPddlError: Anything else.
    """
    listed = expect_list(node, "an atom")
    if listed.head in UNSUPPORTED:
        raise MalformedPddlError(f"{listed.position}: {UNSUPPORTED[listed.head]} are not supported")
    if not listed.items:
        raise MalformedPddlError(f"{listed.position}: expected an atom, found an empty list")
    predicate = expect_word(listed.items[0], "the name of a predicate")
    return Formula(predicate, tuple(expect_word(n, "an argument") for n in listed.items[1:]))


def read_conjunction(node: Node) -> list[Formula]:
    """An atom, or atoms joined by ``and``, however nested; none for ``()`` and ``(and)``.

    Raises:
        MalformedPddlError: Anything else.
    """
    return [read_formula(listed) for listed in _conjuncts(node)]


def _conjuncts(node: Node) -> Iterator[ListNode]:
    listed = expect_list(node, "an atom or a conjunction")
    if listed.head == "and":
        for item in listed.items[1:]:
            yield from _conjuncts(item)
    elif listed.items:
        yield listed
