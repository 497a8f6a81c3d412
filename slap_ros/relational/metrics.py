# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Metrics: what is measured of objects in a state, and the conditions that predicates put on it.

A predicate of a contact domain is a conjunction of conditions on metrics, c = ∧ 1[f_i ≤ ε_i] in the
paper's notation (LG-SAIL §3), where ≥, intervals and plain truth occur as well. The same metrics,
normalised to [0, 1], are the terms of dense rewards. What a language model is told about a
predicate or a metric is generated from the objects of this module, so that code and prompt cannot
differ.
"""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slap_ros.errors import InvalidDomainError
from slap_ros.relational.objects import Column, Object, Type
from slap_ros.relational.state import Array, State

Value = Callable[..., Array]  # (state, *columns) -> values in the metric's unit, (..., atoms)
Scalar = Callable[..., float]  # (state, *objects) -> the same of one state and one choice
TRUTH = "1"  # the unit of metrics that are 1 where something holds and 0 where it does not


@dataclass(frozen=True)
class NormalisedForm:
    """How a metric becomes a number in [0, 1] that a reward can weigh: 1 is best."""

    formula: str  # of the metric d, as prompts show it
    apply: Callable[[Array], Array] = field(compare=False, repr=False)
    rising: bool  # whether a larger metric is better

    @classmethod
    def closeness(cls, scale: float) -> NormalisedForm:
        """1 - tanh(scale |d|): 1 at zero, falling with the distance or angle.

        Args:
            scale: In one by the metric's unit; the paper has 10 for metres and 4 for radians.
        """

        def closeness(values: Array) -> Array:
            near: Array = 1.0 - np.tanh(scale * np.abs(values))
            return near

        return cls(f"1 - tanh({scale:g} |d|)", closeness, rising=False)

    @classmethod
    def fraction(cls, full: float) -> NormalisedForm:
        """The share of the way that is done: d / full, kept within [0, 1].

        Args:
            full: The metric's value, in its unit, from which on the fraction is 1.
        """

        def fraction(values: Array) -> Array:
            return np.clip(values / full, 0.0, 1.0)

        return cls(f"d / {full:g}, kept within [0, 1]", fraction, rising=True)

    @classmethod
    def truth(cls) -> NormalisedForm:
        """The metric itself, which is 0 or 1."""

        def truth(values: Array) -> Array:
            return values

        return cls("d", truth, rising=True)


@dataclass(frozen=True)
class Metric:
    """Something measured of objects in a state.

    It is defined twice. ``value`` answers for many choices of objects at once, and for batches of
    states: it takes a state and one column of objects per type, all equally long. ``scalar`` takes
    one state and one object per type, and is written to be read: its source text is what prompts
    quote. Both must agree; ``test/relational/test_metrics.py`` compares them in random states.
    """

    name: str
    types: tuple[Type, ...]
    unit: str  # m, rad, or TRUTH
    description: str  # one sentence, for people and for prompts
    value: Value = field(compare=False, repr=False)
    scalar: Scalar = field(compare=False, repr=False)
    form: NormalisedForm
    of_hand: bool = False  # whether the hand is one end of what is measured: it is no argument then

    def normalised(self, state: State, *columns: Column) -> Array:
        """The metric in [0, 1].

        Args:
            state: A state or a batch of states.
            columns: One per type, equally long.

        Returns:
            Shape (..., atoms).
        """
        return self.form.apply(self.value(state, *columns))

    def of(self, state: State, *objects: Object) -> float:
        """Its value in a single state, in its unit, by the vectorised definition."""
        return float(self.value(state, *(Column.of(obj) for obj in objects))[..., 0])

    @cached_property
    def definition(self) -> str:
        """The source text of the scalar definition, under the metric's own name.

        Metrics may share a function, and differ in what is best.

        Raises:
            InvalidDomainError: There is none to be had, as for a function made at run time.
        """
        try:
            source = textwrap.dedent(inspect.getsource(self.scalar)).strip()
        except (OSError, TypeError) as error:
            raise InvalidDomainError(
                f"metric {self.name}: the source of its scalar definition cannot be read "
                f"({error}); define it as a function in a module"
            ) from error
        return source.replace(f"def {self.scalar.__name__}(", f"def {self.name}(", 1)

    @cached_property
    def signature(self) -> str:
        """Name and typed arguments, as in ``xy_dis(?hand: hand, ?peg: peg)``."""
        return f"{self.name}({typed_arguments(self.types)})"

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Condition:
    """A metric within bounds, about some of the objects of a predicate.

    Use :func:`at_most`, :func:`at_least`, :func:`within`, :func:`is_true` or :func:`is_false`.
    """

    metric: Metric
    arguments: tuple[int, ...]  # for each of the metric's types, which object of the predicate
    lower: float = -math.inf  # in the metric's unit, as is the next
    upper: float = math.inf

    def __post_init__(self) -> None:
        """Check that it can be judged.

        Raises:
            InvalidDomainError: Too few arguments, bounds that are no numbers, or none at all.
        """
        if len(self.arguments) != len(self.metric.types):
            raise InvalidDomainError(
                f"a condition on {self.metric.signature} names {len(self.arguments)} objects, "
                f"not {len(self.metric.types)}"
            )
        if not self.lower <= self.upper or math.isinf(self._unit):
            raise InvalidDomainError(
                f"a condition on {self.metric.name} has the bounds {self.lower:g} and "
                f"{self.upper:g}; one of them must be finite, and the first not above the second"
            )

    @property
    def _unit(self) -> float:
        """What margins are measured in: half an interval, or the threshold itself."""
        finite = [abs(bound) for bound in (self.lower, self.upper) if math.isfinite(bound)]
        if len(finite) == 2:
            return (self.upper - self.lower) / 2.0 or 1.0
        return (finite[0] or 1.0) if finite else math.inf

    def margin(self, state: State, columns: Sequence[Column]) -> Array:
        """How far the metric is within its bounds, in units of the threshold; at least 0 inside.

        Args:
            state: A state or a batch of states.
            columns: The predicate's, one per type, equally long.

        Returns:
            Shape (..., atoms); an interval's half width, and a truth, count 1.
        """
        values = self.metric.value(state, *(columns[i] for i in self.arguments))
        inside: Array = np.minimum(values - self.lower, self.upper - values) / self._unit
        return inside

    @property
    def rewarded(self) -> bool:
        """Whether the normalised metric grows towards the condition, and not away from it."""
        if self.metric.form.rising:
            return math.isinf(self.upper)
        return self.lower <= 0.0 <= self.upper

    def text(self, names: Sequence[str]) -> str:
        """The condition in words, as in ``radial_dis(?peg, ?hole) <= 0.01 m``.

        Args:
            names: Names of the predicate's objects, in order.
        """
        term = f"{self.metric.name}({', '.join(names[i] for i in self.arguments)})"
        if self.metric.unit == TRUTH and 0.0 < self.lower <= 1.0 <= self.upper:
            return term
        if self.metric.unit == TRUTH and self.lower <= 0.0 <= self.upper < 1.0:
            return f"not {term}"
        unit = "" if self.metric.unit == TRUTH else f" {self.metric.unit}"
        if math.isinf(self.lower):
            return f"{term} <= {self.upper:g}{unit}"
        if math.isinf(self.upper):
            return f"{term} >= {self.lower:g}{unit}"
        return f"{self.lower:g}{unit} <= {term} <= {self.upper:g}{unit}"


def at_most(metric: Metric, upper: float, *arguments: int) -> Condition:
    """The metric is at most a threshold.

    Args:
        metric: What is measured.
        upper: In its unit.
        arguments: Positions of the objects among the predicate's; in order if left out.
    """
    return Condition(metric, _in_order(metric, arguments), upper=upper)


def at_least(metric: Metric, lower: float, *arguments: int) -> Condition:
    """The metric is at least a threshold.

    Args:
        metric: What is measured.
        lower: In its unit.
        arguments: Positions of the objects among the predicate's; in order if left out.
    """
    return Condition(metric, _in_order(metric, arguments), lower=lower)


def within(metric: Metric, lower: float, upper: float, *arguments: int) -> Condition:
    """The metric lies in an interval.

    Args:
        metric: What is measured.
        lower: In its unit.
        upper: In its unit.
        arguments: Positions of the objects among the predicate's; in order if left out.
    """
    return Condition(metric, _in_order(metric, arguments), lower, upper)


def is_true(metric: Metric, *arguments: int) -> Condition:
    """A metric that is 0 or 1 is 1; arguments as for :func:`at_most`."""
    return Condition(metric, _in_order(metric, arguments), lower=0.5)


def is_false(metric: Metric, *arguments: int) -> Condition:
    """A metric that is 0 or 1 is 0; arguments as for :func:`at_most`."""
    return Condition(metric, _in_order(metric, arguments), upper=0.5)


def variable_names(types: Sequence[Type]) -> tuple[str, ...]:
    """A variable per type, named after it: ``?peg``, or ``?cube1`` and ``?cube2`` for two."""
    names = [kind.name for kind in types]
    return tuple(
        f"?{name}{names[: i + 1].count(name)}" if names.count(name) > 1 else f"?{name}"
        for i, name in enumerate(names)
    )


def typed_arguments(types: Sequence[Type]) -> str:
    """Variables with their types, as in ``?peg: peg, ?hole: hole``."""
    names = variable_names(types)
    return ", ".join(f"{name}: {kind}" for name, kind in zip(names, types, strict=True))


def _in_order(metric: Metric, arguments: tuple[int, ...]) -> tuple[int, ...]:
    return arguments or tuple(range(len(metric.types)))
