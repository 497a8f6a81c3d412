# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""S-expressions: tokens nested by parentheses."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.pddl.tokens import Position, tokenise

MAX_DEPTH = 100  # levels of nesting; what is deeper is no PDDL and would exhaust the stack


@dataclass(frozen=True)
class Word:
    """A name, a variable, a keyword or a dash."""

    text: str
    position: Position

    @property
    def keyword(self) -> str:
        """The word in lower case, to be compared with PDDL's own words."""
        return self.text.lower()

    def __str__(self) -> str:
        return repr(self.text)


@dataclass(frozen=True)
class ListNode:
    """A list: what stands between two parentheses."""

    items: tuple[Node, ...]
    position: Position  # of the opening parenthesis

    @property
    def head(self) -> str:
        """The first word in lower case; empty where the list does not begin with a word."""
        first = self.items[0] if self.items else None
        return first.keyword if isinstance(first, Word) else ""

    def __str__(self) -> str:
        return "a list"


Node = Word | ListNode


def read_list(text: str, source: str) -> ListNode:
    """The one list that a text consists of.

    Raises:
        MalformedPddlError: Parentheses do not match, or there is nothing or more than one list.
    """
    first, *others = read_lists(text, source)
    if others:
        raise MalformedPddlError(f"{others[0].position}: the text should end before {others[0]}")
    return first


def read_lists(text: str, source: str) -> list[ListNode]:
    """The lists that a text consists of, at least one.

    Raises:
        MalformedPddlError: Parentheses do not match, or there is nothing, or a word outside.
    """
    starts: list[Position] = []  # of the lists that are still open
    levels: list[list[Node]] = [[]]  # what they hold so far; the text itself is the outermost
    for token in tokenise(text, source):
        if token.text == "(":
            starts.append(token.position)
            levels.append([])
            if len(starts) > MAX_DEPTH:
                raise MalformedPddlError(f"{token.position}: more than {MAX_DEPTH} lists nested")
        elif token.text == ")":
            if not starts:
                raise MalformedPddlError(f"{token.position}: ')' closes nothing")
            items = tuple(levels.pop())
            levels[-1].append(ListNode(items, starts.pop()))
        else:
            levels[-1].append(Word(token.text, token.position))
    if starts:
        raise MalformedPddlError(f"{starts[-1]}: '(' is never closed")
    if not levels[0]:
        start = Position(source, 1, 1)
        raise MalformedPddlError(f"{start}: there is nothing but blanks and comments")
    first, *others = levels[0]
    found = [expect_list(first, "'('")]
    for node in others:
        if isinstance(node, Word):
            raise MalformedPddlError(f"{node.position}: the text should end before {node}")
        found.append(node)
    return found


def expect_word(node: Node, what: str) -> Word:
    """The node, which must be a word.

    Raises:
        MalformedPddlError: It is a list.
    """
    if isinstance(node, ListNode):
        raise MalformedPddlError(f"{node.position}: expected {what}, found {node}")
    return node


def expect_list(node: Node, what: str) -> ListNode:
    """The node, which must be a list.

    Raises:
        MalformedPddlError: It is a word.
    """
    if isinstance(node, Word):
        raise MalformedPddlError(f"{node.position}: expected {what}, found {node}")
    return node
