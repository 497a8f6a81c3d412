# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL's effects: what an operator adds and deletes, where something holds, and what it costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite, prod

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.operators import Variable
from slap_ros.relational.pddl.conditions import (
    TRUE,
    And,
    Condition,
    Literal,
    Scope,
    Term,
    check_supported,
    read_condition,
)
from slap_ros.relational.pddl.names import Names
from slap_ros.relational.pddl.sexpr import ListNode, Node, Word, expect_list, expect_word
from slap_ros.relational.pddl.tokens import Position

TOTAL_COST = "total-cost"


@dataclass(frozen=True)
class Effect:
    """Literals that become true where a condition holds, for all objects of some variables.

    Args:
        variables: Variables of quantifiers around it.
        condition: Condition, judged before anything changes.
        literals: Atoms that are added, and negated ones that are deleted.
    """

    variables: tuple[Variable, ...]
    condition: Condition
    literals: tuple[Literal, ...]


@dataclass(frozen=True)
class Application:
    """A function applied to terms, whose value a problem states."""

    function: str  # in lower case
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class Calculation:
    """Numbers that are added, multiplied, subtracted or divided."""

    sign: str
    parts: tuple[Expression, ...]


Expression = float | Application | Calculation
Values = Mapping[tuple[str, tuple[str, ...]], float]  # by function and names of objects

_OPERATIONS: Mapping[str, Callable[[list[float]], float]] = {
    "+": sum,
    "*": prod,
    "-": lambda parts: parts[0] - sum(parts[1:]) if len(parts) > 1 else -parts[0],
    "/": lambda parts: parts[0] / prod(parts[1:]),
}


def evaluate(expression: Expression, binding: Mapping[str, str], values: Values) -> float | None:
    """The number that an expression stands for; None where the problem does not state it.

    Args:
        expression: What to evaluate.
        binding: Names of objects for its variables.
        values: Values of functions.
    """
    if isinstance(expression, Application):
        objects = tuple(binding.get(term, term) for term in expression.terms)
        return values.get((expression.function, objects))
    if isinstance(expression, Calculation):
        parts = [evaluate(part, binding, values) for part in expression.parts]
        known = [part for part in parts if part is not None]
        try:
            return _OPERATIONS[expression.sign](known) if len(known) == len(parts) else None
        except (ZeroDivisionError, OverflowError):
            return None
    return expression


@dataclass
class EffectReader:
    """Reads the effect of one operator.

    Args:
        scope: What names mean.
        functions: Numbers of arguments, by the name of a function in lower case.
        effects: What was read so far.
        costs: Amount that each ``increase`` adds to the total cost.
    """

    scope: Scope
    functions: Mapping[str, int]
    effects: list[Effect] = field(default_factory=list)
    costs: list[Expression] = field(default_factory=list)

    def read(self, node: Node) -> None:
        """Read a whole effect.

        Raises:
            SlapError: It is none, or of a kind that is not supported, with its position.
        """
        self._read(expect_list(node, "an atom or a conjunction"), self.scope, (), TRUE)

    def _read(
        self,
        listed: ListNode,
        scope: Scope,
        variables: tuple[Variable, ...],
        condition: Condition,
    ) -> None:
        if not listed.items:
            return
        if listed.head == "forall":
            names, body = _two(listed, "a list of variables and an effect")
            inside, found = scope.within(names)
            self._read(_effect(body), inside, (*variables, *found), condition)
        elif listed.head == "when":
            premise, body = _two(listed, "a condition and an effect")
            needed = And((condition, read_condition(premise, scope)))
            self._read(_effect(body), scope, variables, needed)
        elif listed.head == "increase" and not variables and condition == TRUE:
            self.costs.append(self._cost(listed))
        elif listed.head == "and":
            for item in listed.items[1:]:
                self._read(_effect(item), scope, variables, condition)
        else:
            literal = _read_literal(listed, scope)
            self.effects.append(Effect(variables, condition, (literal,)))

    def _cost(self, listed: ListNode) -> Expression:
        target, amount = _two(listed, "a function and an amount")
        if not isinstance(target, ListNode) or target.head != TOTAL_COST or len(target.items) != 1:
            raise MalformedPddlError(
                f"{listed.position}: numeric fluents other than ({TOTAL_COST}) are not supported"
            )
        return self._expression(amount)

    def _expression(self, node: Node) -> Expression:
        if isinstance(node, Word):
            return read_number(node)
        if node.head in _OPERATIONS and len(node.items) > 1:
            return Calculation(node.head, tuple(map(self._expression, node.items[1:])))
        name, arguments = read_application(node, self.functions)
        return Application(name, tuple(self.scope.find(node).name for node in arguments))


def read_application(node: Node, functions: Mapping[str, int]) -> tuple[str, tuple[Node, ...]]:
    """The name of a function in lower case, and what it is applied to.

    Raises:
        MalformedPddlError: No such function is declared, or it takes more or fewer arguments.
    """
    listed = expect_list(node, "a function")
    if not listed.items:
        raise MalformedPddlError(f"{listed.position}: expected a function, found an empty list")
    word = expect_word(listed.items[0], "the name of a function")
    count = Names("function", functions, MalformedPddlError).find(word)
    arguments = listed.items[1:]
    if len(arguments) != count:
        raise MalformedPddlError(
            f"{word.position}: {word.text} takes {count} objects, got {len(arguments)}"
        )
    if word.keyword == TOTAL_COST:
        raise MalformedPddlError(
            f"{word.position}: numeric fluents are not supported: ({TOTAL_COST}) only grows"
        )
    return word.keyword, arguments


def read_number(word: Word) -> float:
    """The number that a word is; whole ones are ``int``, so that sums of them are exact.

    Raises:
        MalformedPddlError: It is no number.
    """
    try:
        number = float(word.text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise MalformedPddlError(f"{word.position}: expected a number, found {word}")
    return int(number) if number.is_integer() else number


def read_literals(node: Node, scope: Scope) -> Iterator[tuple[Position, Literal]]:
    """The atoms and negated atoms of a conjunction, each with its place.

    Raises:
        SlapError: Anything else.
    """
    listed = expect_list(node, "an atom")
    if listed.head == "and":
        for item in listed.items[1:]:
            yield from read_literals(item, scope)
    else:
        yield listed.position, _read_literal(listed, scope)


def _read_literal(listed: ListNode, scope: Scope) -> Literal:
    check_supported(listed)
    if listed.head in ("or", "exists", "imply", "=", "oneof"):
        raise MalformedPddlError(
            f"{listed.position}: {listed.head!r} is a condition, not something that comes true"
        )
    if listed.head != "not":
        return scope.literal(listed)
    if len(listed.items) != 2:
        raise MalformedPddlError(f"{listed.position}: 'not' takes one atom")
    atom = scope.literal(expect_list(listed.items[1], "an atom"))
    return Literal(atom.predicate, atom.terms, positive=False)


def _effect(node: Node) -> ListNode:
    return expect_list(node, "an effect")


def _two(listed: ListNode, what: str) -> tuple[Node, Node]:
    if len(listed.items) != 3:
        raise MalformedPddlError(f"{listed.position}: {listed.head!r} takes {what}")
    return listed.items[1], listed.items[2]
