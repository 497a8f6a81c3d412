# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grounding of operators, static preconditions first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from slap_ros.errors import PlanningLimitError
from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Object
from slap_ros.relational.operators import GroundOperator, LiftedAtom, LiftedOperator, Variable

MAX_BINDINGS = 300_000  # of parameters, partial ones included; some seconds


def ground_operators(
    operators: Iterable[LiftedOperator], space: AtomSpace, max_bindings: int = MAX_BINDINGS
) -> tuple[GroundOperator, ...]:
    """Every application of the operators to different objects that could ever be applicable.

    Parameters are bound one by one, and a static precondition is tested as soon as its variables
    are bound, so that whole branches fall away: grounding first and filtering afterwards costs
    seconds in domains with many objects.

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

    return GroundOperator(
        operator,
        objects,
        mask(operator.preconditions),
        mask(operator.add_effects),
        mask(operator.delete_effects),
    )


def _bindings(operator: LiftedOperator, space: AtomSpace) -> Iterator[dict[Variable, Object]]:
    """Bindings as they grow, one parameter more each; a complete one is in use until the next."""
    tests = _static_tests(operator, space)

    def extend(depth: int, binding: dict[Variable, Object]) -> Iterator[dict[Variable, Object]]:
        yield binding
        if depth == len(operator.parameters):
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
