# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Predicates that several domains have, made for the types of each."""

from __future__ import annotations

from functools import lru_cache

from slap_ros.domains.benchtop.metrics import (
    AT_REST,
    IS_GRASPED,
    LIFT,
    PARALLEL_DIS,
    PERPENDICULAR_DIS,
)
from slap_ros.domains.classifiers import strictly
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import Column, Layout, Metric, Predicate, State, Type
from slap_ros.relational.metrics import Condition, at_least, at_most, is_false, is_true, within
from slap_ros.relational.predicates import Bools, Margin
from slap_ros.relational.state import Array

LIFTED = 0.02  # m over the table, from which on a thing that is grasped is held
LYING = 0.01  # m over the table, up to which a thing lies on it
STACKED = 0.01  # m between the middles of two things, up to which one is on the other
BESIDE = 0.03  # m between the middles of two things, from which on one can be beside the other
TOUCHING = 0.005  # m between an underside and what it stands on
DRAWER_OPEN = 0.1  # m, at least
DRAWER_CLOSED = 0.01  # m, at most


def holding(thing: Type) -> Predicate:
    """The predicate that a thing is grasped and lifted; it and OnTable exclude each other."""
    return Predicate.of("Holding", (thing,), [is_true(IS_GRASPED), at_least(LIFT, LIFTED)])


def on_table(thing: Type) -> Predicate:
    """The predicate that a thing lies on the table."""
    return Predicate.of("OnTable", (thing,), [within(LIFT, -LYING, LYING)])


def standing(*arguments: int) -> tuple[Condition, Condition]:
    """The conditions on a thing that is released and at rest.

    Args:
        arguments: Position, among the predicate's objects, of the thing.
    """
    return is_false(IS_GRASPED, *arguments), is_true(AT_REST, *arguments)


def on(thing: Type, place: Type, name: str = "On", radius: float = STACKED) -> Predicate:
    """The predicate that a thing stands on the middle of a place, released and at rest.

    Args:
        thing: Type of the things that stand.
        place: Type of what they stand on.
        name: Name of the predicate.
        radius: Largest distance between the middles of thing and place, m.
    """
    conditions = [
        at_most(PARALLEL_DIS, radius),
        within(PERPENDICULAR_DIS, -TOUCHING, TOUCHING),
        *standing(0),
    ]
    return Predicate.of(name, (thing, place), conditions)


def is_open(drawer: Type, opening: Metric) -> Predicate:
    """The predicate that a drawer is open far enough for things to go in and out.

    Args:
        drawer: Type of the drawers.
        opening: Metric of how far a drawer is open.
    """
    return Predicate.of("IsCabinetOpen", (drawer,), [at_least(opening, DRAWER_OPEN)])


def is_closed(
    jointed: Type, closure: Metric, name: str = "IsCabinetClose", most: float = DRAWER_CLOSED
) -> Predicate:
    """The predicate that a drawer or a lid is closed.

    Args:
        jointed: Type of the drawers or the lids.
        closure: Metric of how far a drawer or a lid is open.
        name: Name of the predicate.
        most: Largest opening at which it counts as closed, m or rad.
    """
    return Predicate.of(name, (jointed,), [at_most(closure, most)])


def hand_empty(held: Predicate) -> Predicate:
    """The predicate that nothing is held.

    Args:
        held: Holding. What is grasped and not lifted yet leaves the hand empty, so that a pick
            that failed halfway can be begun again.
    """
    (thing,) = held.types

    def margin(state: State) -> Array:
        margins = _margins(held, state, state.layout.column_of(thing))
        return strictly(-margins.max(axis=-1, keepdims=True))

    return _described("HandEmpty", (), margin, "nothing is held")


def over(thing: Type, place: Type) -> Predicate:
    """The relation of a thing that is on a place or just above it, in the hand or not.

    So what is taken away from a place leaves it clear only when it is lifted.
    """
    conditions = [at_most(PARALLEL_DIS, BESIDE), within(PERPENDICULAR_DIS, -TOUCHING, LIFTED)]
    return Predicate.of("Over", (thing, place), conditions)


def is_clear(occupied: Predicate, name: str = "IsClear") -> Predicate:
    """The predicate that nothing is on a place, or in it.

    Args:
        occupied: Predicate of a thing and a place that makes the place not clear: In, or
            :func:`over`. It must be false of a thing and itself.
        name: Name of the predicate.
    """
    thing, place = occupied.types

    def margin(state: State, places: Column) -> Array:
        things, repeated = _pairs(state.layout, thing, places)
        margins = _margins(occupied, state, things, repeated)
        per_thing = margins.reshape(*margins.shape[:-1], -1, len(places.objects))
        return strictly(-per_thing.max(axis=-2))

    return _described(name, (place,), margin, f"there is no {thing} with {occupied.text}")


@lru_cache(maxsize=256)
def _pairs(layout: Layout, thing: Type, places: Column) -> tuple[Column, Column]:
    """Every thing with every place: things and places, the places running fastest."""
    things = layout.of_type(thing)
    pairs = [(one, other) for one in things for other in places.objects]
    return Column(tuple(one for one, _ in pairs)), Column(tuple(other for _, other in pairs))


def _margins(predicate: Predicate, state: State, *columns: Column) -> Array:
    """How far each atom is from its threshold."""
    if predicate.margin is None:
        raise InvalidDomainError(f"{predicate} has no margin, so nothing can be its complement")
    return predicate.margin(state, *columns)


def _described(name: str, types: tuple[Type, ...], margin: Margin, description: str) -> Predicate:
    """A predicate that holds where its margin is at least 0, and that words explain."""

    def classifier(state: State, *columns: Column) -> Bools:
        return margin(state, *columns) >= 0.0

    return Predicate(name, types, classifier, margin, description=description)
