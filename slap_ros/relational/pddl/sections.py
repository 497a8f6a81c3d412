# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame that PDDL domains and problems share: ``(define (KIND NAME) (:section ...) ...)``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.pddl.names import check_free_name, check_name
from slap_ros.relational.pddl.sexpr import (
    ListNode,
    Node,
    Word,
    expect_list,
    expect_word,
    read_lists,
)
from slap_ros.relational.pddl.tokens import located

REQUIREMENTS = (":strips", ":typing")  # of what is written, where nothing else is needed
DIFFERING = (":negative-preconditions", ":equality")  # of parameters that must differ
# Requirements that may be stated. Where one of those at the end is really used, that is refused.
_KNOWN = frozenset(
    re.findall(
        r"\S+",
        """
        :strips :typing :negative-preconditions :disjunctive-preconditions :equality
        :existential-preconditions :universal-preconditions :quantified-preconditions
        :conditional-effects :adl :ucpop :action-costs :domain-axioms :safety-constraints
        :expression-evaluation :subgoal-through-axioms :true-negation :fluents :numeric-fluents
        :goal-utilities :preferences :constraints :derived-predicates :durative-actions
        :duration-inequalities :continuous-effects :timed-initial-literals
        """,
    )
)
_UNSUPPORTED = {
    ":derived": "derived predicates",
    ":axiom": "derived predicates",
    ":durative-action": "durative actions",
    ":process": "durative actions",
    ":event": "durative actions",
    ":constraints": "constraints",
}


@dataclass(frozen=True)
class PddlDefinition:
    """A domain or a problem, cut into its sections."""

    name: Word
    sections: dict[str, list[ListNode]]  # by keyword, in the order of the text

    def optional(self, keyword: str) -> tuple[Node, ...]:
        """What follows the keyword of a section that may be missing.

        Raises:
            MalformedPddlError: There is more than one such section.
        """
        sections = self.sections.get(keyword, [])
        if len(sections) > 1:
            raise MalformedPddlError(f"{sections[1].position}: a second {keyword}")
        return sections[0].items[1:] if sections else ()

    def single(self, keyword: str) -> Node:
        """The one entry of a section that may not be missing.

        Raises:
            MalformedPddlError: There is no or more than one such section, or entry in it.
        """
        entries = self.optional(keyword)
        if len(entries) != 1:
            place = self.sections.get(keyword, [self.name])[0].position
            raise MalformedPddlError(
                f"{place}: {self.name.text} needs one entry in {keyword}, found {len(entries)}"
            )
        return entries[0]


def read_definition(text: str, source: str, kind: str, keywords: Collection[str]) -> PddlDefinition:
    """Cut a text into sections.

    Args:
        text: PDDL.
        source: Where the text comes from, for messages.
        kind: ``domain`` or ``problem``.
        keywords: Keywords of the sections that such a text may have.

    Returns:
        The name and the sections.

    Raises:
        MalformedPddlError: No such definition, or with a section or requirement unknown to us.
    """
    listed = _definition_of(kind, read_lists(text, source))
    title = listed.items[1] if len(listed.items) > 1 else None
    if listed.head != "define" or not isinstance(title, ListNode) or title.head != kind:
        wanted = f"{listed.position}: expected (define ({kind} NAME) ...)"
        other = title.head if isinstance(title, ListNode) else ""
        found = f", found a {other} only" if other in ("domain", "problem") else ""
        if (kind, other) == ("problem", "domain"):
            found += "; give the problem's file after the domain's"
        raise MalformedPddlError(f"{wanted}{found}")
    if len(title.items) != 2:
        raise MalformedPddlError(f"{title.position}: expected ({kind} NAME)")
    name = expect_word(title.items[1], f"the name of the {kind}")
    with located(name.position):
        (check_name if kind == "domain" else check_free_name)(kind, name.text)
    sections: dict[str, list[ListNode]] = {}
    for node in listed.items[2:]:
        section = expect_list(node, "a section")
        _check_section(section, keywords)
        sections.setdefault(section.head, []).append(section)
    definition = PddlDefinition(name, sections)
    _check_requirements(definition.optional(":requirements"))
    return definition


def _definition_of(kind: str, lists: list[ListNode]) -> ListNode:
    """The definition of a kind, in a text that may have one of the other kind as well.

    Raises:
        MalformedPddlError: There is something besides definitions, or several of the kind.
    """
    if len(lists) == 1:
        return lists[0]
    for listed in lists[1:]:
        if listed.head != "define":
            raise MalformedPddlError(f"{listed.position}: the text should end before {listed}")
    found = [listed for listed in lists if _kind_of(listed) == kind]
    if len(found) > 1:
        raise MalformedPddlError(f"{found[1].position}: a second {kind}")
    return found[0] if found else lists[0]


def _kind_of(listed: ListNode) -> str:
    title = listed.items[1] if len(listed.items) > 1 else None
    return title.head if isinstance(title, ListNode) else ""


def _check_section(section: ListNode, keywords: Collection[str]) -> None:
    if section.head in _UNSUPPORTED:
        what = _UNSUPPORTED[section.head]
        raise MalformedPddlError(f"{section.position}: {what} ({section.head}) are not supported")
    if section.head not in keywords:
        raise MalformedPddlError(
            f"{section.position}: unknown section {section.head!r}; there are {', '.join(keywords)}"
        )


def _check_requirements(nodes: Iterable[Node]) -> None:
    for node in nodes:
        word = expect_word(node, "a requirement")
        if word.keyword not in _KNOWN:
            raise MalformedPddlError(f"{word.position}: requirement {word.text} is not supported")
