# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grounding of operators, static preconditions first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Object
from slap_ros.relational.operators import GroundOperator, LiftedAtom, LiftedOperator, Variable


def ground_operators(
    operators: Iterable[LiftedOperator], space: AtomSpace
) -> tuple[GroundOperator, ...]:
    """Every application of the operators to different objects that could ever be applicable.

    Parameters are bound one by one, and a static precondition is tested as soon as its variables
    are bound, so that whole branches fall away: grounding first and filtering afterwards costs
    seconds in domains with many objects.

    Returns:
        Ground operators, in the order of operators, then of objects.
    """
    return tuple(
        _ground(operator, binding, space)
        for operator in operators
        for binding in _bindings(operator, space)
    )


def _ground(
    operator: LiftedOperator, binding: dict[Variable, Object], space: AtomSpace
) -> GroundOperator:
    def mask(atoms: Iterable[LiftedAtom]) -> int:
        return space.mask(atom.ground(binding) for atom in atoms)

    return GroundOperator(
        operator,
        tuple(binding[variable] for variable in operator.parameters),
        mask(operator.preconditions),
        mask(operator.add_effects),
        mask(operator.delete_effects),
    )


def _bindings(operator: LiftedOperator, space: AtomSpace) -> Iterator[dict[Variable, Object]]:
    tests = _static_tests(operator, space)

    def extend(depth: int, binding: dict[Variable, Object]) -> Iterator[dict[Variable, Object]]:
        if depth == len(operator.parameters):
            yield dict(binding)
            return
        variable = operator.parameters[depth]
        for obj in space.layout.of_type(variable.type):
            if obj in binding.values():
                continue
            binding[variable] = obj
            if all(space.bit(atom.ground(binding)) & space.static_truth for atom in tests[depth]):
                yield from extend(depth + 1, binding)
            del binding[variable]

    return extend(0, {})


def _static_tests(operator: LiftedOperator, space: AtomSpace) -> list[list[LiftedAtom]]:
    """The static preconditions that become testable with each parameter."""
    tests: list[list[LiftedAtom]] = [[] for _ in operator.parameters]
    for atom in operator.preconditions:
        if atom.predicate in space.static_predicates and tests:
            bound = [operator.parameters.index(variable) for variable in atom.variables]
            tests[max(bound, default=0)].append(atom)
    return tests
