# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL problems and goals, against a domain or a task."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from slap_ros.errors import (
    MalformedPddlError,
    MismatchedAtomError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Object
from slap_ros.relational.pddl.conditions import Scope, read_condition
from slap_ros.relational.pddl.effects import (
    TOTAL_COST,
    read_application,
    read_literals,
    read_number,
)
from slap_ros.relational.pddl.formulas import Formula, read_conjunction
from slap_ros.relational.pddl.names import Names, check_free_name
from slap_ros.relational.pddl.sections import PddlDefinition, read_definition
from slap_ros.relational.pddl.sexpr import ListNode, Node, expect_list, expect_word, read_list
from slap_ros.relational.pddl.task import PddlDomain, PddlProblem
from slap_ros.relational.pddl.tokens import located
from slap_ros.relational.pddl.typed_list import read_repeated_names
from slap_ros.relational.pddl.types import TypeNames
from slap_ros.relational.predicates import GroundAtom, Predicate
from slap_ros.relational.state import Layout

_PRINTED_ATOM = re.compile(r"\s*([\w-]+)\(([^()]*)\)\s*")  # On(block1, target)
_SECTIONS = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric", ":length")


def parse_problem(text: str, domain: PddlDomain, source: str = "<problem>") -> PddlProblem:
    """Read a problem of a domain.

    Args:
        text: PDDL, which may have a domain besides.
        domain: The domain that the problem says it belongs to.
        source: Where the text comes from, for messages.

    Returns:
        The problem, its atoms ground over its objects.

    Raises:
        MalformedPddlError: Not PDDL, of another domain, or with numeric fluents other than costs,
            preferences, constraints or timed literals.
        UnknownPredicateError: An atom of a predicate that the domain does not have.
        UnknownObjectError: An atom of an object that is not declared.
        MismatchedAtomError: An atom with the wrong number or types of objects.
    """
    definition = read_definition(text, source, "problem", _SECTIONS)
    _check_domain(definition.single(":domain"), domain)
    types = TypeNames({kind.name: kind for kind in domain.types})
    layout = _read_objects(definition.optional(":objects"), domain, types)
    predicates = {predicate.name: predicate for predicate in domain.predicates}
    scope = Scope(
        types,
        Names("predicate", predicates, UnknownPredicateError),
        Names("object", layout.by_name, UnknownObjectError),
        {},
    )
    initial = _InitialState(scope, domain, layout, set(domain.always))
    for node in definition.optional(":init"):
        initial.read(node)
    return PddlProblem(
        definition.name.text,
        layout,
        frozenset(initial.atoms),
        read_condition(definition.single(":goal"), scope),
        initial.values,
        _minimises_cost(definition),
    )


def parse_goal(text: str, space: AtomSpace, source: str = "<goal>") -> frozenset[GroundAtom]:
    """Read an atom or a conjunction of atoms, such as ``(and (On a b) (GripperEmpty robot))``.

    Args:
        text: PDDL.
        space: The task's atoms.
        source: Where the text comes from, for messages.

    Returns:
        The atoms; none for ``()`` and ``(and)``.

    Raises:
        MalformedPddlError: Not PDDL, or more than a conjunction of atoms.
        UnknownPredicateError: A predicate that the domain does not have.
        UnknownObjectError: An object that the task does not have.
        MismatchedAtomError: An atom with the wrong number or types of objects, or with one
            object twice.
    """
    if printed := _PRINTED_ATOM.fullmatch(text):
        words = " ".join((printed[1], *printed[2].replace(",", " ").split()))
        raise MalformedPddlError(f"{source}:1:1: {text.strip()} is not PDDL: write ({words})")
    return _ground(read_conjunction(read_list(text, source)), space.predicates, space.layout)


def _check_domain(node: Node, domain: PddlDomain) -> None:
    word = expect_word(node, "the name of a domain")
    if word.keyword != domain.name.lower():
        raise MalformedPddlError(
            f"{word.position}: a problem of domain {word.text!r}, not of {domain.name!r}"
        )


def _read_objects(nodes: Iterable[Node], domain: PddlDomain, types: TypeNames) -> Layout:
    """The domain's constants, then the problem's objects.

    An object may repeat a constant of the same type: many problems list them again.
    """
    found = {constant.name.lower(): constant for constant in domain.constants}
    constants = frozenset(found)
    listed: set[str] = set()
    for entry in read_repeated_names("object", nodes):
        word, obj = entry.word, Object(entry.word.text, types.of(entry))
        with located(word.position):
            check_free_name("object", word.text)
        known = found.get(word.keyword)
        if word.keyword in listed or (known is not None and known.type != obj.type):
            raise MalformedPddlError(
                f"{word.position}: two objects named {word.text!r}: PDDL does not tell upper from "
                "lower case"
            )
        listed.add(word.keyword)
        if word.keyword not in constants:
            found[word.keyword] = obj
    return Layout.of(tuple(found.values()))


@dataclass
class _InitialState:
    """What a problem says of its start."""

    scope: Scope
    domain: PddlDomain
    layout: Layout
    atoms: set[GroundAtom]
    values: dict[tuple[str, tuple[str, ...]], float] = field(default_factory=dict)

    def read(self, node: Node) -> None:
        """Take what one entry says; that an atom does not hold says nothing new."""
        listed = expect_list(node, "an atom")
        if listed.head == "=":
            self._read_value(listed)
            return
        if listed.head == "at" and any(isinstance(item, ListNode) for item in listed.items):
            raise MalformedPddlError(
                f"{listed.position}: timed literals (as of durative actions) are not supported"
            )
        for _, literal in read_literals(node, self.scope):
            objects = tuple(map(self.layout.object, literal.terms))
            if literal.positive:
                self.atoms.add(GroundAtom(literal.predicate, objects))

    def _read_value(self, listed: ListNode) -> None:
        if not self.domain.functions:
            raise MalformedPddlError(
                f"{listed.position}: equality and numeric fluents are not supported here: the "
                "domain declares no functions"
            )
        if len(listed.items) != 3:
            raise MalformedPddlError(f"{listed.position}: '=' takes a function and its value")
        target = expect_list(listed.items[1], "a function")
        number = read_number(expect_word(listed.items[2], "a number"))
        if target.head == TOTAL_COST:
            return  # where cost begins is no matter
        name, arguments = read_application(target, self.domain.functions)
        key = name, tuple(self.scope.find(node).name for node in arguments)
        if self.values.setdefault(key, number) != number:
            raise MalformedPddlError(
                f"{listed.position}: ({' '.join((name, *key[1]))}) is {number:g} here and "
                f"{self.values[key]:g} before"
            )


def _minimises_cost(definition: PddlDefinition) -> bool:
    """Whether costs count: they do where the metric says so."""
    nodes = definition.optional(":metric")
    if not nodes:
        return False
    place = definition.sections[":metric"][0].position
    direction = expect_word(nodes[0], "minimize or maximize")
    if len(nodes) != 2:
        raise MalformedPddlError(f"{place}: a metric is a direction and one expression")
    fluent = nodes[1]
    head = fluent.head if isinstance(fluent, ListNode) else expect_word(fluent, "").keyword
    if direction.keyword == "minimize" and head in (TOTAL_COST, "total-time"):
        # In a plan of one operator after the other, the number of operators is the time.
        return head == TOTAL_COST
    if isinstance(fluent, ListNode) and _mentions(fluent, "is-violated"):
        raise MalformedPddlError(f"{place}: preferences (is-violated) are not supported")
    raise MalformedPddlError(
        f"{place}: numeric fluents in a metric other than minimize ({TOTAL_COST}) are not supported"
    )


def _mentions(node: Node, keyword: str) -> bool:
    if isinstance(node, ListNode):
        return any(_mentions(item, keyword) for item in node.items)
    return node.keyword == keyword


def _ground(
    formulas: Iterable[Formula], predicates: Mapping[str, Predicate], layout: Layout
) -> frozenset[GroundAtom]:
    predicate_names = Names("predicate", predicates, UnknownPredicateError)
    object_names = Names("object", layout.by_name, UnknownObjectError)

    def atom(formula: Formula) -> GroundAtom:
        predicate = predicate_names.find(formula.predicate)
        objects = tuple(object_names.find(word) for word in formula.arguments)
        with located(formula.position):
            if len(set(objects)) != len(objects):
                raise MismatchedAtomError(f"{predicate} relates different objects, not one twice")
            return predicate(*objects)

    return frozenset(map(atom, formulas))
