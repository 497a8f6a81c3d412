# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL's conditions, as trees: preconditions, goals, and what effects depend on.

Negations are pushed down to atoms and equalities as a condition is read, and implications become
disjunctions, so that five kinds of nodes are left.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from slap_ros.errors import (
    InvalidDomainError,
    MalformedPddlError,
    MismatchedAtomError,
    SlapError,
)
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.objects import Object, Type
from slap_ros.relational.operators import Variable
from slap_ros.relational.pddl.names import Names
from slap_ros.relational.pddl.sexpr import ListNode, Node, Word, expect_list, expect_word
from slap_ros.relational.pddl.typed_list import read_variables
from slap_ros.relational.pddl.types import TypeNames
from slap_ros.relational.predicates import Predicate

Term = str  # name of an object or, with its question mark, of a variable

NUMERIC = ("<", "<=", ">", ">=", "assign", "increase", "decrease", "scale-up", "scale-down")
TRAJECTORY = (  # of PDDL 3, in goals and constraints
    "always", "sometime", "within", "at-most-once", "sometime-after", "sometime-before",
    "always-within", "hold-during", "hold-after",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Literal:
    """An atom that must hold, or must not."""

    predicate: Predicate
    terms: tuple[Term, ...]
    positive: bool = True

    def __str__(self) -> str:
        atom = f"{self.predicate.name}({', '.join(self.terms)})"
        return atom if self.positive else f"not {atom}"


@dataclass(frozen=True, slots=True)
class Equality:
    """Two terms that must stand for one object, or for two."""

    left: Term
    right: Term
    positive: bool = True


@dataclass(frozen=True, slots=True)
class And:
    """All parts hold; without parts, this is the truth."""

    parts: tuple[Condition, ...] = ()


@dataclass(frozen=True, slots=True)
class Or:
    """At least one part holds."""

    parts: tuple[Condition, ...]


@dataclass(frozen=True, slots=True)
class Quantified:
    """The body holds of all objects of the variables' types, or of some."""

    universal: bool
    variables: tuple[Variable, ...]
    body: Condition


Condition = Literal | Equality | And | Or | Quantified
TRUE = And()


def negate(condition: Condition) -> Condition:
    """The condition that holds where this one does not."""
    match condition:
        case And(parts):
            return Or(tuple(map(negate, parts)))
        case Or(parts):
            return And(tuple(map(negate, parts)))
        case Quantified(universal, variables, body):
            return Quantified(not universal, variables, negate(body))
        case _:
            return replace(condition, positive=not condition.positive)


def conjuncts(condition: Condition) -> Iterator[Condition]:
    """What must hold at the same time, conjunctions taken apart."""
    if isinstance(condition, And):
        for part in condition.parts:
            yield from conjuncts(part)
    else:
        yield condition


@dataclass(frozen=True)
class Scope:
    """What names mean at a place of a text.

    Args:
        types: Types of the domain.
        predicates: Predicates of the domain.
        objects: Constants, and in a problem its objects.
        variables: Parameters, and variables of quantifiers around the place.
        operator: Name of the operator that is read, if it is one.
    """

    types: TypeNames
    predicates: Names[Predicate]
    objects: Names[Object]
    variables: Mapping[str, Variable]
    operator: str | None = None

    def within(self, listed: Node) -> tuple[Scope, tuple[Variable, ...]]:
        """The scope inside a quantifier, and the quantifier's variables."""
        entries = read_variables(expect_list(listed, "a list of variables").items)
        found = tuple(Variable(e.word.text, self.types.of(e)) for e in entries)
        known = {name.lower(): v for name, v in self.variables.items()}
        known |= {variable.name.lower(): variable for variable in found}
        return replace(self, variables={v.name: v for v in known.values()}), found

    def find(self, node: Node) -> Variable | Object:
        """The variable or object that a word names.

        Raises:
            MalformedPddlError: No such variable is known here.
            UnknownObjectError: No such object is known here.
        """
        word = expect_word(node, "an argument")
        if word.text.startswith("?"):
            return Names("parameter", self.variables, MalformedPddlError).find(word)
        return self.objects.find(word)

    def literal(self, listed: ListNode) -> Literal:
        """The atom that a list consists of.

        Raises:
            MalformedPddlError: It is not an atom.
            SlapError: It does not fit its predicate.
        """
        if not listed.items:
            raise MalformedPddlError(f"{listed.position}: expected an atom, found an empty list")
        word = expect_word(listed.items[0], "the name of a predicate")
        predicate = self.predicates.find(word)
        terms = tuple(map(self.find, listed.items[1:]))
        literal = Literal(predicate, tuple(term.name for term in terms))
        self._check(word, literal, terms)
        return literal

    def _check(self, word: Word, literal: Literal, terms: tuple[Variable | Object, ...]) -> None:
        wanted = literal.predicate.types
        if len(terms) != len(wanted):
            raise self._mismatch(
                word,
                f"{literal} has {len(terms)} arguments, {literal.predicate} takes {len(wanted)}",
                f"{literal.predicate} takes {len(wanted)} objects, got {len(terms)}",
            )
        for term, kind in zip(terms, wanted, strict=True):
            if not _may_be(term, kind):
                given, needed = a_or_an(term.type), a_or_an(kind)
                raise self._mismatch(
                    word,
                    f"{term} in {literal} is {given}, {literal.predicate} wants {needed}",
                    f"{literal.predicate} wants {needed}, but {term} is {given}",
                )

    def _mismatch(self, word: Word, of_operator: str, of_problem: str) -> SlapError:
        if self.operator is None:
            return MismatchedAtomError(f"{word.position}: {of_problem}")
        return InvalidDomainError(f"{word.position}: operator {self.operator}: {of_operator}")


def _may_be(term: Variable | Object, kind: Type) -> bool:
    """Whether a term can stand for an object of a type: a variable of a wider type may."""
    if isinstance(term, Variable) and kind.is_a(term.type):
        return True
    return term.type.is_a(kind)


def read_condition(node: Node, scope: Scope) -> Condition:
    """The condition that a node states; none for ``()``.

    Raises:
        SlapError: It is none, or of a kind that is not supported, with its position.
    """
    listed = expect_list(node, "an atom or a conjunction")
    if not listed.items:
        return TRUE
    head, parts = listed.head, listed.items[1:]
    if head == "and":
        return And(tuple(read_condition(part, scope) for part in parts))
    if head == "or":
        return Or(tuple(read_condition(part, scope) for part in parts))
    if head == "not":
        return negate(read_condition(_only(listed, 1)[0], scope))
    if head == "imply":
        premise, conclusion = (read_condition(part, scope) for part in _only(listed, 2))
        return Or((negate(premise), conclusion))
    if head in ("forall", "exists"):
        variables, body = _only(listed, 2)
        inside, found = scope.within(variables)
        return Quantified(head == "forall", found, read_condition(body, inside))
    if head == "=":
        return _read_equality(listed, scope)
    check_supported(listed)
    return scope.literal(listed)


def _read_equality(listed: ListNode, scope: Scope) -> Condition:
    sides = _only(listed, 2)
    for side in sides:
        if isinstance(side, ListNode) or _is_number(side):
            raise MalformedPddlError(f"{listed.position}: numeric fluents (=) are not supported")
    left, right = map(scope.find, sides)
    return Equality(left.name, right.name)


def _is_number(word: Word) -> bool:
    try:
        float(word.text)
    except ValueError:
        return False
    return not word.text[0].isalpha()


def check_supported(listed: ListNode) -> None:
    """Refuse what PDDL knows and this reader does not.

    Raises:
        MalformedPddlError: Names it, with its position.
    """
    if listed.head in NUMERIC:
        what = f"numeric fluents ({listed.head})"
    elif listed.head == "preference":
        what = "preferences"
    elif listed.head in TRAJECTORY:
        what = f"constraints ({listed.head})"
    else:
        return
    raise MalformedPddlError(f"{listed.position}: {what} are not supported")


def _only(listed: ListNode, count: int) -> tuple[Node, ...]:
    """The parts of a list that must have so many.

    Raises:
        MalformedPddlError: It has more or fewer.
    """
    parts = listed.items[1:]
    if len(parts) != count:
        what = "one condition" if count == 1 else f"{count} parts"
        raise MalformedPddlError(f"{listed.position}: {listed.head!r} takes {what}")
    return parts
