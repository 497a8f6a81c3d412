# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One object may stand for two parameters, unless an operator or its world says otherwise."""

from __future__ import annotations

from itertools import product

import pytest

from slap_ros.core import Domain
from slap_ros.domains.registry import OURS, get_domain
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import (
    AtomSpace,
    GroundOperator,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Predicate,
    Type,
    Variable,
    ground_operators,
)
from slap_ros.relational.pddl import (
    parse_domain,
    parse_problem,
    with_different_objects,
    write_domain,
    write_problem,
)

PLACE = Type("place")
ONE, OTHER = Variable("?a", PLACE), Variable("?b", PLACE)


def no_classifier(*_: object) -> bool:
    raise AssertionError("static atoms are given")


VISITED, NEAR = (
    Predicate("Visited", (PLACE,), no_classifier),
    Predicate("Near", (PLACE, PLACE), no_classifier),
)


def space(one_object_twice: bool) -> AtomSpace:
    layout = Layout.of((PLACE("x"), PLACE("y")))
    return AtomSpace([VISITED, NEAR], [], layout, no_classifier, one_object_twice=one_object_twice)


def operator(*added: LiftedAtom, differ: bool = False) -> LiftedOperator:
    return LiftedOperator(
        "Go",
        (ONE, OTHER),
        frozenset({LiftedAtom(VISITED, (ONE,))}),
        frozenset(added),
        frozenset({LiftedAtom(NEAR, (ONE, OTHER))} - set(added)),
        ((ONE, OTHER),) if differ else (),
    )


def bound(lifted: LiftedOperator, atoms: AtomSpace) -> list[str]:
    return ["".join(obj.name for obj in g.objects) for g in ground_operators([lifted], atoms)]


def test_one_object_may_stand_for_both() -> None:
    lifted = operator(LiftedAtom(VISITED, (OTHER,)))
    for atoms in (space(True), space(False)):  # what is only deleted need not exist
        assert bound(lifted, atoms) == ["xx", "xy", "yx", "yy"]


def test_parameters_that_must_differ() -> None:
    lifted = operator(LiftedAtom(VISITED, (OTHER,)), differ=True)
    assert bound(lifted, space(True)) == bound(lifted, space(False)) == ["xy", "yx"]


def test_atoms_of_a_world_relate_different_objects() -> None:
    lifted = operator(LiftedAtom(NEAR, (ONE, OTHER)))
    assert bound(lifted, space(False)) == ["xy", "yx"]
    assert bound(lifted, space(True)) == ["xx", "xy", "yx", "yy"]


def test_what_is_added_and_deleted_of_one_object_is_added() -> None:
    lifted = LiftedOperator(
        "Go",
        (ONE, OTHER),
        frozenset(),
        frozenset({LiftedAtom(VISITED, (OTHER,))}),
        frozenset({LiftedAtom(VISITED, (ONE,))}),
    )
    stay, *_ = ground_operators([lifted], space(True))
    assert stay.apply(stay.add_effects) == stay.add_effects


@pytest.mark.parametrize("pair", [(ONE, ONE), (ONE, Variable("?c", PLACE))])
def test_only_two_parameters_can_have_to_differ(pair: tuple[Variable, Variable]) -> None:
    with pytest.raises(InvalidDomainError, match=r"operator Go: .* cannot have to differ"):
        LiftedOperator("Go", (ONE, OTHER), frozenset(), frozenset(), frozenset(), (pair,))


# -- domains that ship ---------------------------------------------------------------------------


def operators_of(domain: Domain) -> tuple[LiftedOperator, ...]:
    written = domain.acquisition.operators if domain.acquisition else ()
    return (*domain.operators, *domain.unskilled, *written)


def applications(domain: Domain, atoms: AtomSpace) -> list[tuple[str, ...]]:
    """Every choice of different objects whose static preconditions hold, by brute force."""
    found = []
    for lifted in operators_of(domain):
        choices = (atoms.layout.of_type(variable.type) for variable in lifted.parameters)
        for objects in product(*choices):
            binding = dict(zip(lifted.parameters, objects, strict=True))
            static = [a for a in lifted.preconditions if a.predicate in atoms.static_predicates]
            if len(set(objects)) == len(objects) and all(
                atoms.bit(atom.ground(binding)) & atoms.static_truth for atom in static
            ):
                found.append((lifted.name, *(obj.name for obj in objects)))
    return found


@pytest.mark.parametrize("name", OURS)
def test_operators_of_domains_that_ship_are_applied_to_different_objects(name: str) -> None:
    domain = get_domain(name)
    atoms = domain.atom_space(domain.task(0).initial_state)
    grounds = ground_operators(operators_of(domain), atoms)
    found = [(g.operator.name, *(obj.name for obj in g.objects)) for g in grounds]
    assert found == applications(domain, atoms)


def masks(grounds: tuple[GroundOperator, ...], atoms: AtomSpace) -> list[tuple[str, ...]]:
    return [
        (
            str(g),
            *(
                ",".join(map(str, atoms.decode(mask)))
                for mask in (g.preconditions, g.add_effects, g.delete_effects)
            ),
        )
        for g in grounds
    ]


@pytest.mark.parametrize("name", ["obstacle_tower", "cluttered_drawer", "stack_at_target"])
def test_written_text_says_which_parameters_differ(name: str) -> None:
    """Read as PDDL, where atoms may relate an object to itself, it means what the domain means."""
    domain = get_domain(name)
    task = domain.task(0)
    atoms = domain.atom_space(task.initial_state)
    operators = operators_of(domain)
    told = with_different_objects(operators)
    text = write_domain(domain.name, domain.types, domain.predicates, told)
    assert "(not (= ?" in text
    assert ":negative-preconditions :equality" in text
    init = tuple(atoms.decode(atoms.abstract(task.initial_state)))
    stated = parse_domain(text)
    problem = parse_problem(
        write_problem("task", domain.name, atoms.layout.objects, init, task.goal), stated
    )
    theirs = problem.atom_space(stated)
    assert masks(ground_operators(stated.operators, theirs), theirs) == masks(
        ground_operators(operators, atoms), atoms
    )
