# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Metrics: both definitions agree, predicates are their conditions, and say so in words."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slap_ros.errors import InvalidDomainError
from slap_ros.relational import (
    Column,
    Feature,
    Metric,
    NormalisedForm,
    Object,
    Predicate,
    State,
    Type,
)
from slap_ros.relational.metrics import (
    TRUTH,
    Condition,
    at_least,
    at_most,
    is_false,
    is_true,
    variable_names,
    within,
)
from slap_ros.relational.state import Array

HAND = Type("hand", (Feature("x", "m"), Feature("y", "m"), Feature("grasps", TRUTH)))
PEG = Type("peg", (Feature("x", "m"), Feature("y", "m")))
hand, peg0, peg1, peg2 = HAND("hand"), PEG("peg0"), PEG("peg1"), PEG("peg2")
PLACE = ("x", "y")


def xy_dis(state: State, one: Object, other: Object) -> float:
    dx = state.get(one, "x") - state.get(other, "x")
    dy = state.get(one, "y") - state.get(other, "y")
    return math.hypot(dx, dy)


def xy_dis_of_all(state: State, ones: Column, others: Column) -> Array:
    return np.linalg.norm(state.gather(ones, PLACE) - state.gather(others, PLACE), axis=-1)


def is_grasped(state: State, hand: Object, peg: Object) -> float:
    return float(state.get(hand, "grasps")) if xy_dis(state, hand, peg) < 0.01 else 0.0


def is_grasped_of_all(state: State, hands: Column, pegs: Column) -> Array:
    near = xy_dis_of_all(state, hands, pegs) < 0.01
    return np.where(near, state.stack(hands, "grasps"), 0.0)


CLOSE = NormalisedForm.closeness(10.0)
TO_PEG = Metric("xy_dis", (HAND, PEG), "m", "Hand to peg.", xy_dis_of_all, xy_dis, CLOSE)
APART = Metric("peg_dis", (PEG, PEG), "m", "Peg to peg.", xy_dis_of_all, xy_dis, CLOSE)
GRASPED = Metric(
    "is_grasped",
    (HAND, PEG),
    TRUTH,
    "The hand holds it.",
    is_grasped_of_all,
    is_grasped,
    NormalisedForm.truth(),
)
NEAR = Predicate.of("Near", (PEG, HAND), [at_most(TO_PEG, 0.05, 1, 0)])

coordinates = st.floats(-0.1, 0.1, allow_subnormal=False)


@st.composite
def states(draw: st.DrawFn) -> State:
    def place() -> dict[str, float]:
        return {"x": draw(coordinates), "y": draw(coordinates)}

    pegs = {peg: place() for peg in (peg0, peg1, peg2)}
    at = draw(st.sampled_from([place(), *pegs.values()]))
    return State.build({hand: at | {"grasps": draw(st.sampled_from([0.0, 1.0]))}} | pegs)


@given(st.lists(states(), min_size=1, max_size=4))
def test_scalar_and_vectorised_definitions_agree(batch: list[State]) -> None:
    several = State.batch(batch)
    pegs, hands = Column((peg0, peg1, peg2)), Column((hand,) * 3)
    for metric in (TO_PEG, GRASPED):
        values = metric.value(several, hands, pegs)
        normalised = metric.normalised(several, hands, pegs)
        assert values.shape == (len(batch), 3)
        for i, state in enumerate(batch):
            for j, peg in enumerate(pegs.objects):
                assert values[i, j] == pytest.approx(metric.scalar(state, hand, peg), abs=1e-12)
                assert metric.of(state, hand, peg) == values[i, j]
        assert ((normalised >= 0) & (normalised <= 1)).all()


@given(states())
def test_a_predicate_is_the_conjunction_of_its_conditions(state: State) -> None:
    conditions = [within(APART, 0.02, 0.1, 0, 1), at_least(APART, 0.01, 1, 0)]
    predicate = Predicate.of("Apart", (PEG, PEG), conditions)
    distance = xy_dis(state, peg0, peg1)
    assert predicate(peg0, peg1).holds(state) == (0.02 <= distance <= 0.1)
    assert predicate.margin is not None
    margin = predicate.margin(state, Column((peg0,)), Column((peg1,)))[0]
    expected = min((distance - 0.02) / 0.04, (0.1 - distance) / 0.04, (distance - 0.01) / 0.01)
    assert margin == pytest.approx(expected)


@given(states())
def test_truth_counts_one_half_of_its_threshold_away(state: State) -> None:
    holding = Predicate.of("Holding", (PEG,), [is_true_of_hand()])
    grasped = is_grasped(state, hand, peg0) == 1.0
    assert holding(peg0).holds(state) == grasped
    assert holding.margin is not None
    assert abs(holding.margin(state, Column((peg0,)))[0]) == 1.0


def is_true_of_hand() -> Condition:
    def held(state: State, peg: Object) -> float:
        return is_grasped(state, hand, peg)

    def held_of_all(state: State, pegs: Column) -> Array:
        return is_grasped_of_all(state, Column((hand,) * len(pegs.objects)), pegs)

    truth = NormalisedForm.truth()
    return is_true(Metric("held", (PEG,), TRUTH, "Held.", held_of_all, held, truth))


def test_texts_are_generated_from_conditions() -> None:
    predicate = Predicate.of(
        "Ready",
        (HAND, PEG),
        [at_most(TO_PEG, 0.05), is_true(GRASPED), is_false(GRASPED), within(TO_PEG, 0.01, 0.2)],
        "and at rest",
    )
    assert predicate.signature == "Ready(?hand: hand, ?peg: peg)"
    assert predicate.text == (
        "xy_dis(?hand, ?peg) <= 0.05 m and is_grasped(?hand, ?peg) and "
        "not is_grasped(?hand, ?peg) and 0.01 m <= xy_dis(?hand, ?peg) <= 0.2 m; and at rest"
    )
    assert NEAR.text == "xy_dis(?hand, ?peg) <= 0.05 m"
    assert variable_names((PEG, HAND, PEG)) == ("?peg1", "?hand", "?peg2")
    assert TO_PEG.definition.startswith("def xy_dis(state: State, one: Object")
    assert "math.hypot" in TO_PEG.definition


@pytest.mark.parametrize("values", [[0.0, 0.01, 0.3], [0.3, 2.0, 900.0]])
def test_normalised_forms_are_monotone_and_within_one(values: list[float]) -> None:
    array = np.array(values)
    close = NormalisedForm.closeness(4.0).apply(array)
    far = NormalisedForm.fraction(0.3).apply(array)
    assert (np.diff(close) <= 0).all() and (close >= 0).all() and (close <= 1).all()
    assert (np.diff(far) >= 0).all() and (far >= 0).all() and (far <= 1).all()


def test_conditions_that_cannot_be_judged_are_refused() -> None:
    with pytest.raises(InvalidDomainError, match="names 1 objects, not 2"):
        at_most(TO_PEG, 0.1, 0)
    for lower, upper in ((math.nan, 1.0), (1.0, 0.0), (-math.inf, math.inf)):
        with pytest.raises(InvalidDomainError, match="bounds"):
            within(TO_PEG, lower, upper)
    with pytest.raises(InvalidDomainError, match="no conditions"):
        Predicate.of("None", (PEG,), [])
    with pytest.raises(InvalidDomainError, match="about object 1"):
        Predicate.of("Near", (HAND,), [at_most(TO_PEG, 0.1, 0, 1)])
    with pytest.raises(InvalidDomainError, match="wants a hand, but object 0 is a peg"):
        Predicate.of("Near", (PEG, HAND), [at_most(TO_PEG, 0.1)])
