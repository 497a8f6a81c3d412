# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a pair of PDDL texts describes: a domain and a problem that belong to no world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from slap_ros.errors import InvalidDomainError
from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Object, Type
from slap_ros.relational.operators import LiftedAtom, LiftedOperator, Variable
from slap_ros.relational.pddl.conditions import TRUE, Condition, Equality, Literal, conjuncts
from slap_ros.relational.pddl.effects import Effect, Expression, Values
from slap_ros.relational.pddl.tokens import Position, located
from slap_ros.relational.predicates import GroundAtom, Predicate
from slap_ros.relational.state import Layout


@dataclass(frozen=True)
class Action:
    """An operator with all that PDDL allows; :class:`LiftedOperator` is its STRIPS part.

    Args:
        name: Name of the operator.
        parameters: Variables that a plan binds; one object may stand for several of them.
        precondition: Condition under which it can be applied.
        effects: What it changes, all at the same time; what is added and deleted is added.
        costs: Terms of its cost.
        position: Where it is written.
    """

    name: str
    parameters: tuple[Variable, ...]
    precondition: Condition
    effects: tuple[Effect, ...]
    costs: tuple[Expression, ...] = ()
    position: Position | None = field(default=None, compare=False)

    def to_operator(self) -> LiftedOperator:
        """The same operator in STRIPS, with parameters that may have to differ.

        Raises:
            InvalidDomainError: It says more than that, or its atoms do not fit its parameters.
        """
        place = self.position or Position("<domain>", 1, 1)
        with located(place):
            before, different = self._strips_preconditions()
            added, deleted = self._strips_effects()
            return LiftedOperator(
                self.name, self.parameters, before, added, deleted - added, different
            )

    def _strips_preconditions(
        self,
    ) -> tuple[frozenset[LiftedAtom], tuple[tuple[Variable, Variable], ...]]:
        atoms, pairs = set(), set()
        places = {variable.name: place for place, variable in enumerate(self.parameters)}
        for part in conjuncts(self.precondition):
            match part:
                case Literal(positive=True):
                    atoms.add(self._lifted(part))
                case Equality(left, right, False) if {left, right} <= set(places):
                    one, other = sorted((places[left], places[right]))
                    pairs.add((one, other))
                case _:
                    raise self._beyond_strips(f"a precondition with {_kind(part)}")
        parameters = self.parameters
        return frozenset(atoms), tuple((parameters[i], parameters[j]) for i, j in sorted(pairs))

    def _strips_effects(self) -> tuple[frozenset[LiftedAtom], frozenset[LiftedAtom]]:
        added: set[LiftedAtom] = set()
        deleted: set[LiftedAtom] = set()
        for effect in self.effects:
            if effect.variables or effect.condition != TRUE:
                raise self._beyond_strips("an effect that depends on a condition or on all objects")
            for literal in effect.literals:
                (added if literal.positive else deleted).add(self._lifted(literal))
        return frozenset(added), frozenset(deleted)

    def _lifted(self, literal: Literal) -> LiftedAtom:
        known = {variable.name: variable for variable in self.parameters}
        if not set(literal.terms) <= set(known):
            raise self._beyond_strips(f"a constant, in {literal}")
        return LiftedAtom(literal.predicate, tuple(known[term] for term in literal.terms))

    def _beyond_strips(self, what: str) -> InvalidDomainError:
        return InvalidDomainError(
            f"operator {self.name} has {what}: slap plan can plan with it, but a skill is learned "
            "for operators whose preconditions and effects are atoms of their parameters"
        )


def _kind(condition: Condition) -> str:
    """What a condition is that STRIPS does not have."""
    if isinstance(condition, Literal):
        return f"a negation, {condition}"
    if isinstance(condition, Equality):
        return "an equality of a parameter or constant"
    return f"{'a quantifier' if 'Quantified' in type(condition).__name__ else 'a disjunction'}"


@dataclass(frozen=True)
class PddlDomain:
    """The symbolic part of a domain.

    Types have no features and predicates no classifiers, for there are no states to look at.

    Args:
        name: Name of the domain.
        types: Types in the order of the text.
        predicates: Predicates in the order of the text.
        actions: Operators in the order of the text.
        constants: Objects that every problem has.
        functions: Numbers of arguments of the functions that costs are made of, by name in lower
            case.
        always: Atoms that hold at first in every problem.
    """

    name: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    actions: tuple[Action, ...]
    constants: tuple[Object, ...] = ()
    functions: Mapping[str, int] = field(default_factory=dict)
    always: frozenset[GroundAtom] = frozenset()

    @cached_property
    def operators(self) -> tuple[LiftedOperator, ...]:
        """The actions as STRIPS operators.

        Raises:
            InvalidDomainError: One of them says more than that.
        """
        return tuple(action.to_operator() for action in self.actions)

    @cached_property
    def static_predicates(self) -> frozenset[Predicate]:
        """The predicates that no operator changes."""
        changed = {
            literal.predicate
            for action in self.actions
            for effect in action.effects
            for literal in effect.literals
        }
        return frozenset(self.predicates) - changed


@dataclass(frozen=True)
class PddlProblem:
    """Objects, the atoms that hold at first, and what shall hold in the end.

    Args:
        name: Name of the problem.
        objects: Objects, the domain's constants first.
        init: Atoms that hold at first.
        condition: Condition that shall hold in the end.
        values: Values of functions.
        minimises_cost: Whether the cheapest plan is asked for; else the shortest is best.
    """

    name: str
    objects: Layout
    init: frozenset[GroundAtom]
    condition: Condition
    values: Values = field(default_factory=dict)
    minimises_cost: bool = False

    @cached_property
    def goal(self) -> frozenset[GroundAtom]:
        """The atoms that shall hold in the end, where the goal is a conjunction of atoms.

        Raises:
            InvalidDomainError: It is anything else.
        """
        atoms = set()
        for part in conjuncts(self.condition):
            match part:
                case Literal(predicate, terms, True):
                    atoms.add(GroundAtom(predicate, tuple(map(self.objects.object, terms))))
                case _:
                    raise InvalidDomainError(
                        f"the goal of problem {self.name} has {_kind(part)}: slap plan can plan "
                        "for it, but skills are learned for goals that are conjunctions of atoms"
                    )
        return frozenset(atoms)

    def atom_space(self, domain: PddlDomain) -> AtomSpace:
        """The ground atoms over the problem's objects; static ones are as they are at first."""
        return AtomSpace(
            domain.predicates,
            domain.static_predicates,
            self.objects,
            self.init.__contains__,
            one_object_twice=True,
        )
