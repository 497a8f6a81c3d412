# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL problems and goals, against a domain or a task."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from slap_ros.errors import (
    MalformedPddlError,
    MismatchedAtomError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Type
from slap_ros.relational.pddl.formulas import Formula, read_conjunction, read_formula
from slap_ros.relational.pddl.names import OBJECT, Names
from slap_ros.relational.pddl.sections import read_definition
from slap_ros.relational.pddl.sexpr import Node, expect_word, read_list
from slap_ros.relational.pddl.task import PddlDomain, PddlProblem
from slap_ros.relational.pddl.tokens import located
from slap_ros.relational.pddl.typed_list import read_names
from slap_ros.relational.predicates import GroundAtom, Predicate
from slap_ros.relational.state import Layout

_SECTIONS = (":domain", ":requirements", ":objects", ":init", ":goal")


def parse_problem(text: str, domain: PddlDomain, source: str = "<problem>") -> PddlProblem:
    """Read a problem of a domain.

    Args:
        text: PDDL.
        domain: The domain that the problem says it belongs to.
        source: Where the text comes from, for messages.

    Returns:
        The problem, its atoms ground over its objects.

    Raises:
        MalformedPddlError: Not PDDL, more than STRIPS with types, or of another domain.
        UnknownPredicateError: An atom of a predicate that the domain does not have.
        UnknownObjectError: An atom of an object that is not declared.
        MismatchedAtomError: An atom with the wrong number or types of objects, or with one
            object twice.
    """
    definition = read_definition(text, source, "problem", _SECTIONS)
    _check_domain(definition.single(":domain"), domain)
    layout = _read_objects(definition.optional(":objects"), domain)
    init = [read_formula(node) for node in definition.optional(":init")]
    goal = read_conjunction(definition.single(":goal"))
    predicates = {predicate.name: predicate for predicate in domain.predicates}
    return PddlProblem(
        definition.name.text,
        layout,
        _ground(init, predicates, layout),
        _ground(goal, predicates, layout),
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
    return _ground(read_conjunction(read_list(text, source)), space.predicates, space.layout)


def _check_domain(node: Node, domain: PddlDomain) -> None:
    word = expect_word(node, "the name of a domain")
    if word.keyword != domain.name.lower():
        raise MalformedPddlError(
            f"{word.position}: a problem of domain {word.text!r}, not of {domain.name!r}"
        )


def _read_objects(nodes: Iterable[Node], domain: PddlDomain) -> Layout:
    types = {OBJECT: Type(OBJECT)} | {kind.name: kind for kind in domain.types}
    names = Names("type", types, MalformedPddlError)
    entries = read_names("object", nodes)
    return Layout.of(tuple(names.find(entry.type)(entry.word.text) for entry in entries))


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
