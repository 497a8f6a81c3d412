# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Abstract states as bits: evaluation, batches, and the door for atoms."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import (
    InvalidDomainError,
    MismatchedAtomError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.relational import LiftedAtom, LiftedOperator, State, Variable, ground_operators

DOMAIN = get_domain("obstacle2d")


def spaces():
    for seed in range(20):
        initial = DOMAIN.task(seed).initial_state
        yield initial, DOMAIN.atom_space(initial)


def random_states(initial, rng, count):
    """States with every feature disturbed: far from what planning visits."""
    data = initial.data + rng.uniform(-0.3, 0.3, (count, initial.layout.size))
    static = [initial.layout.column(s, f) for s in initial.objects[-2:] for f in ("is_target",)]
    data[:, static] = initial.data[static]
    return State(initial.layout, data)


def test_bits_agree_with_asking_atom_by_atom():
    rng = np.random.default_rng(0)
    for initial, space in spaces():
        for row in random_states(initial, rng, 5).data:
            state = State(initial.layout, row)
            asked = {atom for atom in space.atoms if atom.holds(state)}
            assert set(space.decode(space.abstract(state))) == asked


def test_a_batch_agrees_with_single_states():
    rng = np.random.default_rng(1)
    for initial, space in spaces():
        batch = random_states(initial, rng, 50)
        truth = space.truth(batch)
        for row, one in zip(batch.data, truth, strict=True):
            assert (space.truth(State(initial.layout, row)) == one).all()


def test_margin_is_positive_exactly_where_the_atom_holds():
    rng = np.random.default_rng(2)
    for initial, space in spaces():
        for row in random_states(initial, rng, 5).data:
            state = State(initial.layout, row)
            for atom in space.atoms:
                if atom.predicate.margin is not None:
                    from slap_ros.relational import Column

                    margin = atom.predicate.margin(state, *(Column((o,)) for o in atom.objects))
                    assert (margin >= 0).all() == atom.holds(state)


def test_mask_and_decode_are_inverse():
    _, space = next(spaces())
    for mask in (0, 1, space.static_truth, (1 << len(space.atoms)) - 1):
        assert space.mask(space.decode(mask)) == mask


@pytest.mark.parametrize(
    ("predicate", "objects", "error", "words"),
    [
        ("Above", ["block1", "table"], UnknownPredicateError, "unknown predicate 'Above'"),
        ("On", ["block1", "sofa"], UnknownObjectError, "unknown object 'sofa'"),
        ("On", ["block1"], MismatchedAtomError, "takes 2 objects, got 1"),
        ("On", ["table", "block1"], MismatchedAtomError, "wants a block"),
    ],
)
def test_atoms_are_checked_at_the_door(predicate, objects, error, words):
    _, space = next(spaces())
    with pytest.raises(error, match=words):
        space.atom(predicate, objects)


def test_grounding_equals_filtering_all_bindings():
    """Static preconditions early must not lose or add an operator."""
    for initial, space in spaces():
        truth = space.abstract(initial) & space.static
        everything = ground_operators(
            [
                LiftedOperator(
                    o.name,
                    o.parameters,
                    frozenset(
                        a for a in o.preconditions if a.predicate not in space.static_predicates
                    ),
                    o.add_effects,
                    o.delete_effects,
                )
                for o in DOMAIN.operators
            ],
            space,
        )
        full = {o.name: o for o in DOMAIN.operators}
        wanted = set()
        for ground in everything:
            binding = dict(zip(ground.operator.parameters, ground.objects, strict=True))
            static = [
                a.ground(binding)
                for a in full[ground.operator.name].preconditions
                if a.predicate in space.static_predicates
            ]
            if space.mask(static) & ~truth == 0:
                wanted.add(str(ground))
        assert {str(g) for g in DOMAIN.ground(space)} == wanted


def test_operators_delete_before_they_add():
    _, space = next(spaces())
    for ground in DOMAIN.ground(space):
        for abstract in (0, (1 << len(space.atoms)) - 1):
            after = ground.apply(abstract)
            assert after & ground.add_effects == ground.add_effects
            assert after & ground.delete_effects & ~ground.add_effects == 0


def test_an_operator_with_a_foreign_variable_is_refused():
    on = next(p for p in DOMAIN.predicates if p.name == "On")
    block, surface = on.types
    x, y = Variable("?x", block), Variable("?y", surface)
    atom = LiftedAtom(on, (x, y))
    with pytest.raises(InvalidDomainError, match=r"\?y in On\(\?x, \?y\) is not among"):
        LiftedOperator("Bad", (x,), frozenset({atom}), frozenset(), frozenset())
    with pytest.raises(InvalidDomainError, match="both adds and deletes"):
        LiftedOperator("Bad", (x, y), frozenset(), frozenset({atom}), frozenset({atom}))


def test_a_predicate_of_more_objects_than_there_are_has_no_atoms():
    initial = get_domain("cluttered_drawer", "fair:obstacles=0").task(0).initial_state
    space = get_domain("cluttered_drawer", "fair:obstacles=0").atom_space(initial)
    assert "BlockingLeft" not in {atom.predicate.name for atom in space.atoms}
    assert space.atom("LeftClear", ["block1"]) in set(space.decode(space.abstract(initial)))
