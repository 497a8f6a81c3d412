# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL domains: types, predicates and operators, with their names looked up."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from slap_ros.errors import (
    InvalidDomainError,
    MalformedPddlError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.relational.objects import Column, Object
from slap_ros.relational.operators import Variable
from slap_ros.relational.pddl.conditions import TRUE, Scope, read_condition
from slap_ros.relational.pddl.effects import TOTAL_COST, EffectReader, read_literals
from slap_ros.relational.pddl.names import Names, check_words
from slap_ros.relational.pddl.sections import PddlDefinition, read_definition
from slap_ros.relational.pddl.sexpr import ListNode, Node, Word, expect_list, expect_word
from slap_ros.relational.pddl.task import Action, PddlDomain
from slap_ros.relational.pddl.typed_list import (
    TypedName,
    read_names,
    read_repeated_names,
    read_signature,
    read_variables,
)
from slap_ros.relational.pddl.types import TypeNames, make_types
from slap_ros.relational.predicates import Bools, Classifier, GroundAtom, Predicate
from slap_ros.relational.state import State

_SECTIONS = (
    ":requirements",
    ":types",
    ":constants",
    ":predicates",
    ":functions",
    ":timeless",
    ":action",
)
# What PDDL 1.2 calls :vars are parameters that follow from the others; a plan names them too.
_ACTION_PARTS = (":parameters", ":vars", ":precondition", ":effect")


def parse_domain(text: str, source: str = "<domain>") -> PddlDomain:
    """Read a domain.

    The type ``object`` appears in the result only where a predicate or an operator uses it, by
    name or by leaving a parameter untyped; all types descend from it then.

    Args:
        text: PDDL, which may have a problem besides.
        source: Where the text comes from, for messages.

    Raises:
        MalformedPddlError: Not PDDL, or with derived predicates, numeric fluents other than costs,
            durative actions, constraints or preferences.
        UnknownPredicateError: An operator uses a predicate that is not declared.
        UnknownObjectError: An operator uses a constant that is not declared.
        InvalidDomainError: The atoms of an operator do not fit its parameters.
    """
    definition = read_definition(text, source, "domain", _SECTIONS)
    signatures = [_read_signature(node) for node in definition.optional(":predicates")]
    actions = [_ActionText.of(listed) for listed in definition.sections.get(":action", [])]
    functions = _read_functions(definition)
    constants = read_names("constant", definition.optional(":constants"))
    check_words("predicate", (signature.name for signature in signatures))
    check_words("operator", (action.name for action in actions))

    lists = [signature.parameters for signature in signatures]
    lists += [action.parameters for action in actions]
    untyped = any(entry.is_untyped for entries in (*lists, constants) for entry in entries)
    declared = read_repeated_names("type", definition.optional(":types"))
    types = make_types(declared, untyped or any(action.has_quantifier for action in actions))
    type_names = TypeNames(types)
    predicates = {s.name.text: _make_predicate(s, type_names) for s in signatures}
    objects = {
        entry.word.text: Object(entry.word.text, type_names.of(entry)) for entry in constants
    }
    scope = Scope(
        type_names,
        Names("predicate", predicates, UnknownPredicateError),
        Names("object", objects, UnknownObjectError),
        {},
    )
    return PddlDomain(
        definition.name.text,
        tuple(types.values()),
        tuple(predicates.values()),
        tuple(_make_action(action, scope, functions) for action in actions),
        tuple(objects.values()),
        functions,
        frozenset(_timeless(definition.optional(":timeless"), scope, objects)),
    )


# -- the text's own structure, names not looked up yet --------------------------------------------


@dataclass(frozen=True)
class _Declaration:
    """A predicate or a function as it is declared."""

    name: Word
    parameters: list[TypedName]


@dataclass(frozen=True)
class _ActionText:
    """An operator as it is written."""

    name: Word
    parameters: list[TypedName]
    parts: dict[str, Node]

    @classmethod
    def of(cls, listed: ListNode) -> _ActionText:
        if len(listed.items) < 2:
            raise MalformedPddlError(f"{listed.position}: an action without a name")
        name = expect_word(listed.items[1], "the name of an action")
        parts = _action_parts(name, listed.items[2:])
        nodes: list[Node] = []
        for keyword in (":parameters", ":vars"):
            nothing = ListNode((), name.position)
            nodes += expect_list(parts.get(keyword, nothing), "a list of parameters").items
        return cls(name, read_variables(nodes), parts)

    @property
    def has_quantifier(self) -> bool:
        """Whether a condition or an effect is about all or some objects."""
        return any(map(_has_quantifier, self.parts.values()))


def _has_quantifier(node: Node) -> bool:
    if isinstance(node, Word):
        return False
    return node.head in ("forall", "exists") or any(map(_has_quantifier, node.items))


def _read_signature(node: Node) -> _Declaration:
    listed = expect_list(node, "a predicate")
    if not listed.items:
        raise MalformedPddlError(f"{listed.position}: expected a predicate, found an empty list")
    name = expect_word(listed.items[0], "the name of a predicate")
    return _Declaration(name, read_signature(listed.items[1:]))


def _read_functions(definition: PddlDefinition) -> dict[str, int]:
    """Numbers of arguments by the name of a function; what type its values have means nothing."""
    found: dict[str, int] = {}
    for node in definition.optional(":functions"):
        if isinstance(node, ListNode):
            signature = _read_signature(node)
            found[signature.name.keyword] = len(signature.parameters)
    if found.get(TOTAL_COST):
        place = definition.sections[":functions"][0].position
        raise MalformedPddlError(f"{place}: ({TOTAL_COST}) takes no objects")
    return found


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


def _make_predicate(signature: _Declaration, types: TypeNames) -> Predicate:
    name = signature.name.text
    return Predicate(name, tuple(map(types.of, signature.parameters)), _no_classifier(name))


def _no_classifier(name: str) -> Classifier:
    def classifier(*_: State | Column) -> Bools:
        raise InvalidDomainError(
            f"predicate {name} was read from PDDL and cannot be evaluated in a state; "
            "use the predicate of the domain that has a world"
        )

    return classifier


def _make_action(text: _ActionText, scope: Scope, functions: dict[str, int]) -> Action:
    name = text.name.text
    parameters = tuple(Variable(p.word.text, scope.types.of(p)) for p in text.parameters)
    inside = Scope(
        scope.types, scope.predicates, scope.objects, {v.name: v for v in parameters}, name
    )
    condition = text.parts.get(":precondition")
    before = TRUE if condition is None else read_condition(condition, inside)
    reader = EffectReader(inside, functions)
    if ":effect" in text.parts:
        reader.read(text.parts[":effect"])
    return Action(
        name,
        parameters,
        before,
        tuple(reader.effects),
        tuple(reader.costs),
        text.name.position,
    )


def _timeless(
    nodes: Iterable[Node], scope: Scope, constants: Mapping[str, Object]
) -> Iterator[GroundAtom]:
    for node in nodes:
        for position, literal in read_literals(node, scope):
            if not literal.positive:
                raise MalformedPddlError(f"{position}: what always holds is an atom")
            objects = tuple(constants[term] for term in literal.terms)
            yield GroundAtom(literal.predicate, objects)
