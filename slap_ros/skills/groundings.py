# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An operator's groundings, asked about side by side: each row of a batch has its own.

One skill is learned for all groundings of a lifted operator. Rows of a batch differ in the objects
that the operator is applied to, and maybe in the objects that there are at all; states of fewer
objects are padded with zeros, so that all are rows of one array.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slap_ros.relational import Column, Layout, Object, State, Type
from slap_ros.relational.state import Array

Number = np.float64 | np.bool_
N = TypeVar("N", bound=Number)
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Grounding:
    """The objects that a skill is applied to.

    Args:
        layout: Layout of the objects that there are.
        objects: Objects for the operator's parameters, in order.
    """

    layout: Layout
    objects: tuple[Object, ...]


@dataclass(frozen=True)
class GroundedStates:
    """States over the same objects, and what the operator is applied to in each.

    Args:
        rows: Indices of these rows in the whole batch, shape (n,).
        state: Batch of n states.
        columns: Objects of g groundings for each of the operator's parameters, all of one type per
            parameter.
        choice: Index of the grounding of each state among these groundings, shape (n,).
    """

    rows: Indices
    state: State
    columns: tuple[Column, ...]
    choice: Indices

    @property
    def types(self) -> tuple[Type, ...]:
        """The type of each parameter's objects."""
        return tuple(column.objects[0].type for column in self.columns)

    def pick(self, values: NDArray[N]) -> NDArray[N]:
        """Each state's own among the values for all groundings, shape (n, g, ...) to (n, ...)."""
        return values[np.arange(len(values)), self.choice]


@dataclass(frozen=True)
class _Kind:
    """Groundings over the same objects, each parameter's of one type."""

    layout: Layout
    columns: tuple[Column, ...]
    numbers: Indices  # numbers of these groundings, ascending


class Groundings:
    """The groundings that one skill is learned for, by number."""

    def __init__(self, groundings: Sequence[Grounding]) -> None:
        """Number groundings in their order, which must be without repetition."""
        self.groundings = tuple(groundings)
        self._numbers = {grounding: i for i, grounding in enumerate(self.groundings)}

    def number(self, grounding: Grounding) -> int:
        """The number of a grounding, which must be one of them."""
        return self._numbers[grounding]

    @cached_property
    def width(self) -> int:
        """The length of a row: the number of features of the state with the most."""
        return max(grounding.layout.size for grounding in self.groundings)

    @cached_property
    def _kinds(self) -> tuple[_Kind, ...]:
        members: dict[tuple[Layout, tuple[Type, ...]], list[int]] = {}
        for i, grounding in enumerate(self.groundings):
            types = tuple(obj.type for obj in grounding.objects)
            members.setdefault((grounding.layout, types), []).append(i)
        return tuple(
            _Kind(
                layout,
                tuple(
                    Column(objects)
                    for objects in zip(*(self.groundings[i].objects for i in numbers), strict=True)
                ),
                np.array(numbers, dtype=np.intp),
            )
            for (layout, _), numbers in members.items()
        )

    @cached_property
    def _kind_of_each(self) -> Indices:
        """The index of the kind of each grounding."""
        kinds = np.empty(len(self.groundings), dtype=np.intp)
        for i, kind in enumerate(self._kinds):
            kinds[kind.numbers] = i
        return kinds

    def rows(self, states: Array) -> Array:
        """States of one layout, shape (n, size), padded to shape (n, width)."""
        missing = self.width - states.shape[-1]
        return np.pad(states, ((0, 0), (0, missing))) if missing else states

    def split(self, rows: Array, numbers: Indices) -> Iterator[GroundedStates]:
        """Split rows of states by the objects that they are about.

        Args:
            rows: States as rows, shape (n, width).
            numbers: Number of the grounding of each state, shape (n,).

        Yields:
            The parts; together they have every row once.
        """
        kinds = self._kind_of_each[numbers]
        for i in np.unique(kinds):
            kind, where = self._kinds[i], np.flatnonzero(kinds == i)
            state = State(kind.layout, rows[where, : kind.layout.size])
            choice = np.searchsorted(kind.numbers, numbers[where])
            yield GroundedStates(where, state, kind.columns, choice)
