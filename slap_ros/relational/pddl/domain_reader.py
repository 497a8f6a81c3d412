# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL domains into the relational layer's own classes: STRIPS with types, nothing more.

Where PDDL is laxer than the relational layer, ours holds: atoms relate different objects, and the
parameters of an operator stand for different objects.
"""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidDomainError, MalformedPddlError, UnknownPredicateError
from slap_ros.relational.objects import Column, Type
from slap_ros.relational.operators import LiftedAtom, LiftedOperator, Variable
from slap_ros.relational.pddl.formulas import Formula, read_conjunction, read_effect
from slap_ros.relational.pddl.names import OBJECT, Names, check_words
from slap_ros.relational.pddl.sections import read_definition
from slap_ros.relational.pddl.sexpr import (
    MAX_DEPTH,
    ListNode,
    Node,
    Word,
    expect_list,
    expect_word,
)
from slap_ros.relational.pddl.task import PddlDomain
from slap_ros.relational.pddl.tokens import located
from slap_ros.relational.pddl.typed_list import TypedName, read_names, read_variables
from slap_ros.relational.predicates import Bools, Classifier, Predicate
from slap_ros.relational.state import State

_SECTIONS = (":requirements", ":types", ":predicates", ":action")
_ACTION_PARTS = (":parameters", ":precondition", ":effect")


def parse_domain(text: str, source: str = "<domain>") -> PddlDomain:
    """Read a domain.

    The type ``object`` appears in the result only where a predicate or an operator uses it, by
    name or by leaving a parameter untyped; all types descend from it then.

    Args:
        text: PDDL.
        source: Where the text comes from, for messages.

    Raises:
        MalformedPddlError: Not PDDL, or more than STRIPS with types.
        UnknownPredicateError: An operator uses a predicate that is not declared.
        InvalidDomainError: The atoms of an operator do not fit its parameters or each other.
    """
    definition = read_definition(text, source, "domain", _SECTIONS)
    declared = read_names("type", definition.optional(":types"))
    signatures = [_read_signature(node) for node in definition.optional(":predicates")]
    actions = [_read_action(listed) for listed in definition.sections.get(":action", [])]
    check_words("predicate", (signature.name for signature in signatures))
    check_words("operator", (action.name for action in actions))

    parameter_lists = [part.parameters for part in signatures]
    parameter_lists += [part.parameters for part in actions]
    uses_object = any(p.type.keyword == OBJECT for ps in parameter_lists for p in ps)
    types = _make_types(declared, uses_object)
    type_names = Names("type", types, MalformedPddlError)
    predicates = {s.name.text: _make_predicate(s, type_names) for s in signatures}
    predicate_names = Names("predicate", predicates, UnknownPredicateError)
    return PddlDomain(
        definition.name.text,
        tuple(types.values()),
        tuple(predicates.values()),
        tuple(_make_operator(action, type_names, predicate_names) for action in actions),
    )


# -- the text's own structure, names not looked up yet --------------------------------------------


@dataclass(frozen=True)
class _PredicateDeclaration:
    """A predicate as it is declared."""

    name: Word
    parameters: list[TypedName]


@dataclass(frozen=True)
class _ActionDefinition:
    """An operator as it is written."""

    name: Word
    parameters: list[TypedName]
    preconditions: list[Formula]
    add_effects: list[Formula]
    delete_effects: list[Formula]


def _read_signature(node: Node) -> _PredicateDeclaration:
    listed = expect_list(node, "a predicate")
    if not listed.items:
        raise MalformedPddlError(f"{listed.position}: expected a predicate, found an empty list")
    name = expect_word(listed.items[0], "the name of a predicate")
    return _PredicateDeclaration(name, read_variables(listed.items[1:]))


def _read_action(listed: ListNode) -> _ActionDefinition:
    if len(listed.items) < 2:
        raise MalformedPddlError(f"{listed.position}: an action without a name")
    name = expect_word(listed.items[1], "the name of an action")
    parts = _action_parts(name, listed.items[2:])
    if ":parameters" not in parts:
        raise MalformedPddlError(f"{name.position}: action {name.text} has no :parameters")
    nothing = ListNode((), name.position)
    add_effects, delete_effects = read_effect(parts.get(":effect", nothing))
    return _ActionDefinition(
        name,
        read_variables(expect_list(parts[":parameters"], "a list of parameters").items),
        read_conjunction(parts.get(":precondition", nothing)),
        add_effects,
        delete_effects,
    )


def _action_parts(name: Word, nodes: tuple[Node, ...]) -> dict[str, Node]:
    """What follows each keyword of an action."""
    parts: dict[str, Node] = {}
    for i in range(0, len(nodes), 2):
        word = expect_word(nodes[i], " or ".join(_ACTION_PARTS))
        if word.keyword not in _ACTION_PARTS:
            raise MalformedPddlError(
                f"{word.position}: action {name.text} has {word}; there are "
                f"{', '.join(_ACTION_PARTS)}"
            )
        if word.keyword in parts:
            raise MalformedPddlError(f"{word.position}: a second {word.keyword}")
        if i + 1 == len(nodes):
            raise MalformedPddlError(f"{word.position}: nothing follows {word.keyword}")
        parts[word.keyword] = nodes[i + 1]
    return parts


# -- the relational layer's classes ---------------------------------------------------------------


def _make_types(declared: list[TypedName], with_object: bool) -> dict[str, Type]:
    """The types by name: ``object`` first where it is wanted, then the declared ones in order."""
    for entry in declared:
        if entry.word.keyword == OBJECT and entry.type.keyword != OBJECT:
            raise MalformedPddlError(f"{entry.word.position}: type {OBJECT!r} cannot have a parent")
    entries = {entry.word.text: entry for entry in declared if entry.word.keyword != OBJECT}
    names = Names("type", entries, MalformedPddlError)
    root = Type(OBJECT) if with_object else None
    built: dict[str, Type] = {}

    def build(entry: TypedName, below: tuple[str, ...]) -> Type:
        name, position = entry.word.text, entry.word.position
        if name in below:
            raise MalformedPddlError(f"{position}: type {name} descends from itself")
        if len(below) > MAX_DEPTH:
            raise MalformedPddlError(f"{position}: more than {MAX_DEPTH} types below {name}")
        if name not in built:
            is_root = entry.type.keyword == OBJECT
            built[name] = Type(
                name, parent=root if is_root else build(names.find(entry.type), (*below, name))
            )
        return built[name]

    types = {OBJECT: root} if root else {}
    return types | {name: build(entry, ()) for name, entry in entries.items()}


def _make_predicate(signature: _PredicateDeclaration, types: Names[Type]) -> Predicate:
    name = signature.name.text
    return Predicate(
        name, tuple(types.find(entry.type) for entry in signature.parameters), _no_classifier(name)
    )


def _no_classifier(name: str) -> Classifier:
    def classifier(*_: State | Column) -> Bools:
        raise InvalidDomainError(
            f"predicate {name} was read from PDDL and cannot be evaluated in a state; "
            "use the predicate of the domain that has a world"
        )

    return classifier


def _make_operator(
    action: _ActionDefinition, types: Names[Type], predicates: Names[Predicate]
) -> LiftedOperator:
    name = action.name.text
    parameters = tuple(Variable(p.word.text, types.find(p.type)) for p in action.parameters)
    variables = Names("parameter", {v.name: v for v in parameters}, MalformedPddlError)

    def atom(formula: Formula) -> LiftedAtom:
        lifted = LiftedAtom(
            predicates.find(formula.predicate),
            tuple(variables.find(word) for word in formula.arguments),
        )
        with located(formula.position):  # an operator checks its atoms, but knows no positions
            LiftedOperator(name, parameters, frozenset({lifted}), frozenset(), frozenset())
        return lifted

    preconditions = frozenset(map(atom, action.preconditions))
    add_effects = frozenset(map(atom, action.add_effects))
    delete_effects = frozenset(map(atom, action.delete_effects))
    with located(action.name.position):
        return LiftedOperator(name, parameters, preconditions, add_effects, delete_effects)
