# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Predicates and ground atoms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidDomainError, MismatchedAtomError
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.metrics import Condition, typed_arguments, variable_names
from slap_ros.relational.objects import Column, Object, Type
from slap_ros.relational.state import Array, State

T = TypeVar("T")
Bools = NDArray[np.bool_]
Classifier = Callable[..., Bools]  # (state, *columns) -> truth, shape (..., atoms)
Margin = Callable[..., Array]  # (state, *columns) -> signed distance to the threshold, (..., atoms)


@dataclass(frozen=True)
class Predicate:
    """A named relation between objects that holds or not in a state.

    Both functions answer for many atoms at once, and for a batch of states as well: they take a
    state and one column of objects per type, all equally long, and answer with shape
    (..., atoms). One call for all atoms of a predicate is what makes perception fast. The margin
    says how far the state is from the threshold (positive where
    the predicate holds), in the unit of the metric behind it; it is None where no metric is.
    """

    name: str
    types: tuple[Type, ...]
    classifier: Classifier = field(compare=False, repr=False)
    margin: Margin | None = field(default=None, compare=False, repr=False)
    conditions: tuple[Condition, ...] = field(default=(), compare=False, repr=False)
    description: str = field(default="", compare=False, repr=False)  # what conditions do not say

    @classmethod
    def threshold(cls, name: str, types: tuple[Type, ...], margin: Margin) -> Predicate:
        """A predicate that holds where its margin is at least 0.

        Args:
            name: The predicate's.
            types: Types of the objects that the predicate relates.
            margin: Signed distance to the threshold, in the unit of the metric behind it.
        """

        def classifier(state: State, *columns: Column) -> Bools:
            return margin(state, *columns) >= 0.0

        return cls(name, types, classifier, margin)

    @classmethod
    def of(
        cls,
        name: str,
        types: tuple[Type, ...],
        conditions: Sequence[Condition],
        description: str = "",
    ) -> Predicate:
        """A predicate that holds where all conditions on metrics do.

        Args:
            name: The predicate's.
            types: Types of the objects that the predicate relates.
            conditions: At least one; their arguments are positions in ``types``.
            description: What its conditions do not say, for people and for prompts.

        Returns:
            A predicate whose margin is the least of the conditions', each in units of its own
            threshold.

        Raises:
            InvalidDomainError: No condition, or one about an object or a type that it has not.
        """
        if not conditions:
            raise InvalidDomainError(f"predicate {name} has no conditions; it needs at least one")
        for condition in conditions:
            _check_arguments(name, types, condition)

        def margin(state: State, *columns: Column) -> Array:
            least = conditions[0].margin(state, columns)
            for condition in conditions[1:]:
                least = np.minimum(least, condition.margin(state, columns))
            return least

        def classifier(state: State, *columns: Column) -> Bools:
            return margin(state, *columns) >= 0.0

        return cls(name, types, classifier, margin, tuple(conditions), description)

    @property
    def signature(self) -> str:
        """Name and typed arguments, as in ``In(?peg: peg, ?hole: hole)``."""
        return f"{self.name}({typed_arguments(self.types)})"

    @property
    def text(self) -> str:
        """What it means, generated from its conditions; empty where there is nothing to say."""
        names = variable_names(self.types)
        parts = [" and ".join(condition.text(names) for condition in self.conditions)]
        return "; ".join(part for part in (*parts, self.description) if part)

    def __call__(self, *objects: Object) -> GroundAtom:
        """The atom that applies this predicate to objects.

        Raises:
            MismatchedAtomError: Their number or types do not fit.
        """
        if len(objects) != len(self.types):
            raise MismatchedAtomError(
                f"{self.name} takes {len(self.types)} objects, got {len(objects)}"
            )
        for obj, wanted in zip(objects, self.types, strict=True):
            if not obj.type.is_a(wanted):
                raise MismatchedAtomError(
                    f"{self.name} wants {a_or_an(wanted)}, but {obj.name} is {a_or_an(obj.type)}"
                )
        return GroundAtom(self, objects)

    def __str__(self) -> str:
        return self.name


def _check_arguments(name: str, types: tuple[Type, ...], condition: Condition) -> None:
    for position, wanted in zip(condition.arguments, condition.metric.types, strict=True):
        if not 0 <= position < len(types):
            raise InvalidDomainError(
                f"predicate {name}: a condition on {condition.metric.name} is about object "
                f"{position}, but the predicate relates {len(types)}"
            )
        if not types[position].is_a(wanted):
            raise InvalidDomainError(
                f"predicate {name}: {condition.metric.signature} wants {a_or_an(wanted)}, but "
                f"object {position} is {a_or_an(types[position])}"
            )


def cache_latest(compute: Callable[[State], T]) -> Callable[[State], T]:
    """Compute once what several predicates ask of the same state one after the other.

    The latest state is cached with its answer, and stays in memory until another is asked about.
    """
    latest: tuple[State, T] | None = None

    @wraps(compute)
    def answer(state: State) -> T:
        nonlocal latest
        known = latest  # read once: threads may compute twice, but never mix up states
        if known is None or known[0] is not state:
            known = latest = (state, compute(state))
        return known[1]

    return answer


@dataclass(frozen=True)
class GroundAtom:
    """A predicate applied to objects."""

    predicate: Predicate
    objects: tuple[Object, ...]

    def holds(self, state: State) -> bool:
        """Whether it holds in a single state."""
        columns = [Column.of(obj) for obj in self.objects]
        return bool(self.predicate.classifier(state, *columns).all())

    def __str__(self) -> str:
        return f"{self.predicate.name}({', '.join(obj.name for obj in self.objects)})"

    __repr__ = __str__  # a goal is a set of atoms, which shows them so
