# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grounding of operators, static preconditions first."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations

from slap_ros.errors import PlanningLimitError
from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Object
from slap_ros.relational.operators import GroundOperator, LiftedAtom, LiftedOperator, Variable

MAX_BINDINGS = 300_000  # of parameters, partial ones included; some seconds

_Test = Callable[[Mapping[Variable, Object]], bool]  # of a binding, partial or complete


def ground_operators(
    operators: Iterable[LiftedOperator], space: AtomSpace, max_bindings: int = MAX_BINDINGS
) -> tuple[GroundOperator, ...]:
    """Every application of the operators to objects that could ever be applicable.

    One object may stand for two parameters, unless these must differ, or an atom that is needed or
    added would relate the object to itself and the space has no such atoms.

    Parameters are bound one by one, and an inequality or a static precondition is tested as soon as
    its variables are bound, so that whole branches fall away: grounding first and filtering
    afterwards costs seconds in domains with many objects.

    Args:
        operators: To be applied.
        space: The atoms over the objects.
        max_bindings: Partial and complete bindings to look at before giving up.

    Returns:
        Ground operators, in the order of operators, then of objects.

    Raises:
        PlanningLimitError: There are more than ``max_bindings`` bindings.
    """
    found: list[GroundOperator] = []
    left = max_bindings
    for operator in operators:
        for binding in _bindings(operator, space):
            left -= 1
            if left < 0:
                raise PlanningLimitError(
                    f"more than {max_bindings} bindings of operators' parameters to objects, at "
                    f"{operator.name} with {len(operator.parameters)} of them; give fewer "
                    "parameters or objects"
                )
            if len(binding) == len(operator.parameters):
                objects = tuple(binding[variable] for variable in operator.parameters)
                found.append(ground_operator(operator, objects, space))
    return tuple(found)


def ground_operator(
    operator: LiftedOperator, objects: tuple[Object, ...], space: AtomSpace
) -> GroundOperator:
    """One application of an operator.

    Args:
        operator: To be applied.
        objects: For its parameters, in order.
        space: The atoms over the objects.
    """
    binding = dict(zip(operator.parameters, objects, strict=True))

    def mask(atoms: Iterable[LiftedAtom]) -> int:
        return space.mask(atom.ground(binding) for atom in atoms)

    added = mask(operator.add_effects)
    grounds = (atom.ground(binding) for atom in operator.delete_effects)
    # What relates an object to itself may not be an atom of the space: it never holds. What is
    # added as well is added: of two parameters, both effects may be of one object.
    deleted = space.mask(atom for atom in grounds if space.has(atom)) & ~added
    return GroundOperator(operator, objects, mask(operator.preconditions), added, deleted)


def _bindings(operator: LiftedOperator, space: AtomSpace) -> Iterator[dict[Variable, Object]]:
    """Bindings as they grow, one parameter more each; a complete one is in use until the next."""
    tests = _tests(operator, space)

    def extend(depth: int, binding: dict[Variable, Object]) -> Iterator[dict[Variable, Object]]:
        yield binding
        if depth == len(operator.parameters):
            return
        variable = operator.parameters[depth]
        for obj in space.layout.of_type(variable.type):
            binding[variable] = obj
            if all(test(binding) for test in tests[depth]):
                yield from extend(depth + 1, binding)
            del binding[variable]

    return extend(0, {})


def _tests(operator: LiftedOperator, space: AtomSpace) -> list[list[_Test]]:
    """What can be tested once each parameter is bound."""
    tests: list[list[_Test]] = [[] for _ in operator.parameters]
    position = operator.parameters.index
    for one, other in operator.inequalities:
        tests[max(position(one), position(other))].append(partial(_differ, one, other))
    for atom in operator.preconditions | operator.add_effects:
        if not atom.variables:
            continue
        depth = max(map(position, atom.variables))
        if atom.predicate in space.static_predicates and atom in operator.preconditions:
            tests[depth].append(partial(_holds, atom, space))
        elif _may_coincide(atom.variables):
            tests[depth].append(partial(_exists, atom, space))
    return tests


def _differ(one: Variable, other: Variable, binding: Mapping[Variable, Object]) -> bool:
    return binding[one] != binding[other]


def _holds(atom: LiftedAtom, space: AtomSpace, binding: Mapping[Variable, Object]) -> bool:
    ground = atom.ground(binding)
    return space.has(ground) and bool(space.bit(ground) & space.static_truth)


def _exists(atom: LiftedAtom, space: AtomSpace, binding: Mapping[Variable, Object]) -> bool:
    return space.has(atom.ground(binding))


def _may_coincide(variables: Sequence[Variable]) -> bool:
    """Whether one object may stand for two of some variables."""
    return any(one.type.overlaps(other.type) for one, other in combinations(variables, 2))
