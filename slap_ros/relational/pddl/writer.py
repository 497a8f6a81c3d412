# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The relational layer's classes as PDDL text: STRIPS with types, and parameters that differ."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from itertools import combinations, permutations

from slap_ros.errors import InvalidDomainError, UnknownObjectError
from slap_ros.relational.objects import Object, Type
from slap_ros.relational.operators import LiftedAtom, LiftedOperator, Variable
from slap_ros.relational.pddl.names import OBJECT, bare_variable, check_name, check_new_name
from slap_ros.relational.pddl.sections import DIFFERING, REQUIREMENTS
from slap_ros.relational.pddl.types import EitherType
from slap_ros.relational.predicates import GroundAtom, Predicate


def write_domain(
    name: str,
    types: Sequence[Type],
    predicates: Sequence[Predicate],
    operators: Sequence[LiftedOperator],
) -> str:
    """A PDDL domain. The same arguments give the same text.

    A type ``object`` is PDDL's own, from which every type descends.

    Args:
        name: The domain's.
        types: All of them, parents too.
        predicates: Those that operators, problems and goals may use.
        operators: In the order in which they are written.

    Raises:
        MalformedPddlError: A name that PDDL cannot hold, or two that differ in case alone.
        InvalidDomainError: A type or predicate is used, but not among those given.
    """
    check_name("domain", name)
    _check_distinct("type", (kind.name for kind in types))
    _check_distinct("predicate", (predicate.name for predicate in predicates))
    _check_distinct("operator", (operator.name for operator in operators))
    _check_types(types)
    differing = any(operator.inequalities for operator in operators)
    sections = [
        f"(:requirements {' '.join((*REQUIREMENTS, *(DIFFERING if differing else ())))})",
        _block(":types", _typed((kind.name, kind.parent) for kind in types if kind.name != OBJECT)),
        _block(":predicates", [_signature(predicate, types) for predicate in predicates]),
        *(_action(operator, types, predicates) for operator in operators),
    ]
    return _definition(f"(domain {name})", sections)


def with_different_objects(operators: Iterable[LiftedOperator]) -> list[LiftedOperator]:
    """The operators of a domain with a world, as PDDL has to be told what they mean.

    Atoms of such a domain relate different objects, so parameters of one atom that is needed or
    added stand for different objects. PDDL has atoms of one object twice.

    Args:
        operators: Operators in the domain's own words.
    """
    return [replace(operator, inequalities=_different(operator)) for operator in operators]


def _different(operator: LiftedOperator) -> tuple[tuple[Variable, Variable], ...]:
    related = {
        pair
        for atom in operator.preconditions | operator.add_effects
        for pair in permutations(atom.variables, 2)
    }
    return tuple(
        (one, other)
        for one, other in combinations(operator.parameters, 2)
        if (one, other) in operator.inequalities
        or ((one, other) in related and one.type.overlaps(other.type))
    )


def write_problem(
    name: str,
    domain_name: str,
    objects: Sequence[Object],
    init_atoms: Collection[GroundAtom],
    goal_atoms: Collection[GroundAtom],
) -> str:
    """A PDDL problem. The same arguments give the same text.

    Args:
        name: The problem's.
        domain_name: The name under which its domain is written.
        objects: All of them.
        init_atoms: The atoms that hold at first, static ones too.
        goal_atoms: The atoms that must hold in the end.

    Raises:
        MalformedPddlError: A name that PDDL cannot hold, or two that differ in case alone.
        UnknownObjectError: An atom of an object that is not among those given.
    """
    check_name("problem", name)
    check_name("domain", domain_name)
    atoms = sorted({*init_atoms, *goal_atoms}, key=str)
    _check_distinct("object", (obj.name for obj in objects))
    _check_distinct("type", dict.fromkeys(obj.type.name for obj in objects))
    _check_distinct("predicate", dict.fromkeys(atom.predicate.name for atom in atoms))
    known = frozenset(objects)
    for atom in atoms:
        for obj in atom.objects:
            if obj not in known:
                raise UnknownObjectError(f"{obj} in {atom} is not among the problem's objects")
    sections = [
        f"(:domain {domain_name})",
        _block(":objects", _typed((obj.name, obj.type) for obj in objects)),
        _block(":init", _atoms(init_atoms)),
        f"(:goal {_block('and', _atoms(goal_atoms))})",
    ]
    return _definition(f"(problem {name})", sections)


# -- checks -------------------------------------------------------------------------------------


def _check_distinct(kind: str, names: Iterable[str]) -> None:
    taken: set[str] = set()
    for name in names:
        check_new_name(kind, name, taken)


def _check_types(types: Sequence[Type]) -> None:
    """Every parent is among the types, and every type descends from ``object`` if that is."""
    has_object = any(kind.name.lower() == OBJECT for kind in types)
    for kind in types:
        if kind.parent is not None:
            _check_known(kind.parent, types, f"type {kind}")
        if has_object and (kind.parent is None) != (kind.name == OBJECT):
            raise InvalidDomainError(
                f"type {kind}: PDDL has a type {OBJECT!r}, in lower case, above all others"
            )


def _check_known(
    used: Type | Predicate, known: Sequence[Type] | Sequence[Predicate], where: str
) -> None:
    if isinstance(used, EitherType):
        for kind in used.alternatives:
            _check_known(kind, known, where)
    elif used not in known:
        raise InvalidDomainError(
            f"{where} uses {used}, which is not among those given: {', '.join(map(str, known))}"
        )


# -- parts --------------------------------------------------------------------------------------


def _signature(predicate: Predicate, types: Sequence[Type]) -> str:
    for kind in predicate.types:
        _check_known(kind, types, f"predicate {predicate}")
    parameters = _typed((f"?x{i}", kind) for i, kind in enumerate(predicate.types, start=1))
    return _list(predicate.name, *parameters)


def _action(
    operator: LiftedOperator, types: Sequence[Type], predicates: Sequence[Predicate]
) -> str:
    _check_distinct("variable", (bare_variable(v.name) for v in operator.parameters))
    for variable in operator.parameters:
        _check_known(variable.type, types, f"operator {operator}")
    for atom in operator.preconditions | operator.add_effects | operator.delete_effects:
        _check_known(atom.predicate, predicates, f"operator {operator}")
    effects = [*_atoms(operator.add_effects)]
    effects += [f"(not {atom})" for atom in _atoms(operator.delete_effects)]
    differ = [f"(not (= {one} {other}))" for one, other in operator.inequalities]
    lines = [
        f"(:action {operator.name}",
        f"  :parameters ({' '.join(_typed((v.name, v.type) for v in operator.parameters))})",
        f"  :precondition {_indent(_block('and', [*_atoms(operator.preconditions), *differ]))}",
        f"  :effect {_indent(_block('and', effects))})",
    ]
    return "\n".join(lines)


def _typed(entries: Iterable[tuple[str, Type | None]]) -> list[str]:
    return [f"{name} - {kind or OBJECT}" for name, kind in entries]


def _atoms(atoms: Iterable[LiftedAtom] | Iterable[GroundAtom]) -> list[str]:
    """In the order of their text, for sets have none."""
    return sorted(_list(atom.predicate.name, *_arguments(atom)) for atom in atoms)


def _arguments(atom: LiftedAtom | GroundAtom) -> list[str]:
    arguments: Sequence[Variable | Object]
    arguments = atom.variables if isinstance(atom, LiftedAtom) else atom.objects
    return [argument.name for argument in arguments]


# -- layout -------------------------------------------------------------------------------------


def _definition(title: str, sections: Iterable[str]) -> str:
    body = "\n".join(f"  {_indent(section)}" for section in sections)
    return f"(define {title}\n{body})\n"


def _list(*words: str) -> str:
    return f"({' '.join(words)})"


def _block(head: str, lines: Iterable[str]) -> str:
    """A list with a line for each of its items."""
    return "\n  ".join([f"({head}", *lines]) + ")"


def _indent(text: str) -> str:
    """Two columns to the right, the first line apart."""
    return text.replace("\n", "\n  ")
