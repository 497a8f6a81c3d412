# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Metrics and predicates of domains at a bench, in states in which everything is anywhere."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.relational import Column, State
from support.marks import slow
from support.scattered_states import BENCHTOP, STATES, metrics_of, scattered

ONE_BY_ONE = 60  # states, in which every metric and predicate is spelled out
EXACT = 1e-9
BARELY = 1e-6  # rad: the angle between axes that are nearly parallel is not known better


def objects_of(layout, types):
    """Every choice of different objects for types."""
    return [
        chosen
        for chosen in permutations(layout.objects, len(types))
        if all(obj.type.is_a(kind) for obj, kind in zip(chosen, types, strict=True))
    ]


@pytest.mark.parametrize("name", [BENCHTOP[0], *slow(*BENCHTOP[1:])])
def test_conditions_hold_as_the_readable_definitions_of_metrics_say(name):
    domain, batch = get_domain(name), scattered(name)
    space = domain.atom_space(domain.task(0).initial_state)
    truth = space.truth(batch)
    for row in range(ONE_BY_ONE):
        state = State(batch.layout, batch.data[row])
        for i, atom in enumerate(space.atoms):
            conditions = atom.predicate.conditions
            values = [
                c.metric.scalar(state, *(atom.objects[k] for k in c.arguments)) for c in conditions
            ]
            holds = all(
                c.lower <= value <= c.upper for c, value in zip(conditions, values, strict=True)
            )
            assert not conditions or holds == truth[row, i], (str(atom), values)


@pytest.mark.parametrize("name", BENCHTOP)
def test_both_definitions_of_a_metric_agree(name):
    domain, batch = get_domain(name), scattered(name)
    for metric in metrics_of(domain):
        chosen = objects_of(batch.layout, metric.types)
        columns = [Column(objects) for objects in zip(*chosen, strict=True)]
        values = metric.value(batch, *columns)
        normalised = metric.normalised(batch, *columns)
        assert values.shape == (STATES, len(chosen))
        assert ((normalised >= 0.0) & (normalised <= 1.0)).all()
        for row in range(ONE_BY_ONE):
            state = State(batch.layout, batch.data[row])
            spelled_out = [metric.scalar(state, *objects) for objects in chosen]
            tolerance = BARELY if metric.unit == "rad" else EXACT
            assert values[row] == pytest.approx(spelled_out, abs=tolerance), metric.name


@pytest.mark.parametrize("name", BENCHTOP)
def test_what_prompts_quote_is_there(name):
    for metric in metrics_of(get_domain(name)):
        assert metric.definition.startswith(f"def {metric.name}(state: State")
        assert metric.description.endswith(".")


@pytest.mark.parametrize("name", BENCHTOP)
def test_nothing_is_held_and_on_the_table(name):
    domain, batch = get_domain(name), scattered(name)
    space = domain.atom_space(domain.task(0).initial_state)
    truth = space.truth(batch)
    of = {str(atom): i for i, atom in enumerate(space.atoms)}
    pairs = [(of[f"Holding{a}"], i) for n, i in of.items() if (a := n.removeprefix("OnTable")) != n]
    assert bool(pairs) == ("OnTable" in {p.name for p in domain.predicates})
    assert not any((truth[:, held] & truth[:, lying]).any() for held, lying in pairs)
    held = [i for n, i in of.items() if n.startswith("Holding")]
    assert (truth[:, of["HandEmpty()"]] != truth[:, held].any(axis=1)).all()


@pytest.mark.parametrize("name", BENCHTOP)
def test_what_learners_observe_is_relative_to_the_hand(name):
    """All that is at the bench moved by as much as the hand looks the same."""
    domain, batch = get_domain(name), scattered(name)
    interface = domain.learning.interface
    columns = [batch.layout.column_of(obj.type) for obj in batch.objects]
    shifted = batch.data.copy()
    for obj in batch.objects:
        for feature, way in (("x", 0.1), ("y", -0.2), ("target_x", 0.1), ("target_y", -0.2)):
            if feature in obj.type.column:
                shifted[:, batch.layout.column(obj, feature)] += way
    seen, moved = (
        [
            interface.robot(state, hand),
            *(interface.objects(state, hand, column) for column in columns),
            *(interface.distance(state, hand, column) for column in columns),
            *(interface.separation(state, batch.objects[0], column) for column in columns),
        ]
        for state in (batch, State(batch.layout, shifted))
        for hand in (interface.hand(state),)
    )
    for one, other in zip(seen, moved, strict=True):
        assert len(one) == STATES
        np.testing.assert_allclose(one, other, rtol=0.0, atol=EXACT)
