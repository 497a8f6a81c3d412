# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""STRIPS operators, lifted and ground."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from slap_ros.errors import InvalidDomainError
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.objects import Object, Type
from slap_ros.relational.predicates import GroundAtom, Predicate


@dataclass(frozen=True)
class Variable:
    """A typed parameter of an operator, named with a leading question mark."""

    name: str
    type: Type

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class LiftedAtom:
    """A predicate applied to variables."""

    predicate: Predicate
    variables: tuple[Variable, ...]

    def ground(self, binding: Mapping[Variable, Object]) -> GroundAtom:
        """The atom with each variable replaced by its object."""
        return GroundAtom(self.predicate, tuple(binding[variable] for variable in self.variables))

    def __str__(self) -> str:
        return f"{self.predicate.name}({', '.join(v.name for v in self.variables)})"


@dataclass(frozen=True)
class LiftedOperator:
    """What an option needs and what it changes: PAR, PRE, EFF+, EFF-.

    As in PDDL, one object may stand for several parameters, except for those that must differ.

    Args:
        name: Name of the operator.
        parameters: Variables that objects are bound to.
        preconditions: Atoms that must hold.
        add_effects: Atoms that hold afterwards.
        delete_effects: Atoms that no longer hold afterwards.
        inequalities: Pairs of parameters that must stand for different objects, in the order of
            the parameters; in PDDL ``(not (= ?a ?b))``.
    """

    name: str
    parameters: tuple[Variable, ...]
    preconditions: frozenset[LiftedAtom]
    add_effects: frozenset[LiftedAtom]
    delete_effects: frozenset[LiftedAtom]
    inequalities: tuple[tuple[Variable, Variable], ...] = ()

    def __post_init__(self) -> None:
        """Check that atoms use the operator's own parameters with the right types.

        Raises:
            InvalidDomainError: Names the atom at fault.
        """
        for atom in sorted(self.preconditions | self.add_effects | self.delete_effects, key=str):
            if len(atom.variables) != len(atom.predicate.types):
                raise InvalidDomainError(
                    f"operator {self.name}: {atom} has {len(atom.variables)} arguments, "
                    f"{atom.predicate.name} takes {len(atom.predicate.types)}"
                )
            for variable, wanted in zip(atom.variables, atom.predicate.types, strict=True):
                if variable not in self.parameters:
                    raise InvalidDomainError(
                        f"operator {self.name}: {variable} in {atom} is not among its parameters"
                    )
                if not variable.type.is_a(wanted):
                    raise InvalidDomainError(
                        f"operator {self.name}: {variable} in {atom} is "
                        f"{a_or_an(variable.type)}, {atom.predicate.name} wants {a_or_an(wanted)}"
                    )
        for pair in self.inequalities:
            if pair[0] == pair[1] or not set(pair) <= set(self.parameters):
                names = " and ".join(map(str, pair))
                raise InvalidDomainError(
                    f"operator {self.name}: {names} cannot have to differ: give two of its "
                    "parameters"
                )
        if clash := self.add_effects & self.delete_effects:
            raise InvalidDomainError(
                f"operator {self.name} both adds and deletes {', '.join(sorted(map(str, clash)))}"
            )

    @property
    def signature(self) -> str:
        """Name and typed parameters, as in ``Insert(?peg: peg, ?hole: hole)``."""
        parameters = ", ".join(f"{variable}: {variable.type}" for variable in self.parameters)
        return f"{self.name}({parameters})"

    def __str__(self) -> str:
        return f"{self.name}({', '.join(v.name for v in self.parameters)})"


def static_predicates(
    predicates: Iterable[Predicate], operators: Iterable[LiftedOperator]
) -> frozenset[Predicate]:
    """The predicates that no operator changes."""
    changed = {
        atom.predicate
        for operator in operators
        for atom in operator.add_effects | operator.delete_effects
    }
    return frozenset(predicates) - changed


@dataclass(frozen=True, slots=True)
class GroundOperator:
    """An operator applied to objects, as masks over a task's atom space."""

    operator: LiftedOperator
    objects: tuple[Object, ...]
    preconditions: int
    add_effects: int
    delete_effects: int

    def applicable(self, abstract: int) -> bool:
        """Whether all preconditions hold."""
        return abstract & self.preconditions == self.preconditions

    def apply(self, abstract: int) -> int:
        """The abstract state after it: deletes first, then adds."""
        return (abstract & ~self.delete_effects) | self.add_effects

    def __str__(self) -> str:
        return f"{self.operator.name}({', '.join(obj.name for obj in self.objects)})"
