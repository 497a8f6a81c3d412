# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Object-centric states, backed by one immutable array."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slap_ros.errors import InvalidStateError, UnknownObjectError
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.objects import Column, Object, Type

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Where each object's features lie in a state's array.

    Layouts of the same objects in the same order are one and the same: use :meth:`of`.
    """

    objects: tuple[Object, ...]

    @staticmethod
    @lru_cache(maxsize=4096)
    def of(objects: tuple[Object, ...]) -> Layout:
        """The layout of these objects.

        Raises:
            InvalidStateError: Two objects share a name.
        """
        names = [obj.name for obj in objects]
        if len(set(names)) != len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise InvalidStateError(f"object names must be unique, but {twice} occur twice")
        return Layout(objects)

    def __reduce__(self) -> tuple[Callable[..., Layout], tuple[tuple[Object, ...]]]:
        """Sent to another process as its objects alone; there it is one and the same again."""
        return Layout.of, (self.objects,)

    @cached_property
    def slices(self) -> dict[Object, slice]:
        """The part of the array that each object has."""
        slices, start = {}, 0
        for obj in self.objects:
            slices[obj] = slice(start, start + len(obj.type.features))
            start = slices[obj].stop
        return slices

    @cached_property
    def size(self) -> int:
        """Length of the array."""
        return sum(len(obj.type.features) for obj in self.objects)

    @cached_property
    def by_name(self) -> dict[str, Object]:
        """The objects by name."""
        return {obj.name: obj for obj in self.objects}

    @cached_property
    def _columns(self) -> dict[tuple[Object, str], int]:
        return {
            (obj, feature.name): self.slices[obj].start + i
            for obj in self.objects
            for i, feature in enumerate(obj.type.features)
        }

    def column(self, obj: Object, feature: str) -> int:
        """Index of an object's feature in the array.

        Raises:
            UnknownObjectError: The layout has no such object or the object no such feature.
        """
        try:
            return self._columns[obj, feature]
        except KeyError:
            raise UnknownObjectError(
                f"no feature {feature!r} of {obj.name!r}; the objects are {sorted(self.by_name)}"
            ) from None

    def columns(self, objects: Sequence[Object], feature: str) -> NDArray[np.intp]:
        """Indices of one feature of several objects."""
        return np.array([self.column(obj, feature) for obj in objects], dtype=np.intp)

    def indices(self, column: Column, feature: str) -> NDArray[np.intp]:
        """Indices of one feature of a column of objects; cached with the column."""
        cached = column.cached_indices(self)
        if feature not in cached:
            cached[feature] = self.columns(column.objects, feature)
        return cached[feature]

    def grid(self, column: Column, features: tuple[str, ...]) -> NDArray[np.intp]:
        """Indices of features of a column of objects, shape (objects, features); as above."""
        cached = column.cached_indices(self)
        if features not in cached:
            cached[features] = np.stack([self.columns(column.objects, f) for f in features], -1)
        return cached[features]

    @cached_property
    def _by_type(self) -> dict[Type, Column]:
        return {}

    def column_of(self, wanted: Type) -> Column:
        """The objects of a type, or of one below it, as a column; always the same one."""
        if wanted not in self._by_type:
            found = tuple(obj for obj in self.objects if obj.type.is_a(wanted))
            self._by_type[wanted] = Column(found)
        return self._by_type[wanted]

    def object(self, name: str) -> Object:
        """The object of that name.

        Raises:
            UnknownObjectError: There is none.
        """
        try:
            return self.by_name[name]
        except KeyError:
            raise UnknownObjectError(
                f"unknown object {name!r}; the task has {', '.join(sorted(self.by_name))}"
            ) from None

    def of_type(self, wanted: Type) -> tuple[Object, ...]:
        """The objects of a type or of a type below it, in layout order."""
        return self.column_of(wanted).objects


class State:
    """The features of every object: all that is needed to continue from here.

    ``data`` is read-only, float64, of shape (size,); or (..., size) for a batch of states of the
    same objects, which predicates and worlds accept as well.
    """

    __slots__ = ("_key", "data", "layout")

    def __init__(self, layout: Layout, data: ArrayLike) -> None:
        """Take ``data``; the array is made read-only, not copied.

        Raises:
            InvalidStateError: The last axis does not have the layout's size.
        """
        array = np.ascontiguousarray(data, dtype=np.float64)
        if array.shape[-1:] != (layout.size,):
            raise InvalidStateError(
                f"a state of {len(layout.objects)} objects has {layout.size} features, "
                f"not an array of shape {array.shape}"
            )
        array.flags.writeable = False
        self.layout = layout
        self.data = array
        self._key: bytes | None = None

    @classmethod
    def build(cls, features: Mapping[Object, Mapping[str, float]]) -> State:
        """A state from each object's features by name.

        Raises:
            InvalidStateError: A feature is missing, unknown or not finite.
        """
        values: list[float] = []
        for obj, given in features.items():
            wanted = [feature.name for feature in obj.type.features]
            if set(given) != set(wanted):
                raise InvalidStateError(
                    f"{obj.name} is {a_or_an(obj.type)} with features {wanted}, got {sorted(given)}"
                )
            values.extend(float(given[name]) for name in wanted)
        state = cls(Layout.of(tuple(features)), values)
        state.require_finite()
        return state

    @classmethod
    def batch(cls, states: Sequence[State]) -> State:
        """States of the same objects as one, shape (n, size)."""
        return cls(states[0].layout, np.stack([state.data for state in states]))

    def alone(self) -> State:
        """A batch of this state alone, shape (1, size)."""
        return State(self.layout, self.data[None])

    def require_finite(self) -> None:
        """Refuse NaN and infinity.

        Raises:
            InvalidStateError: Names the first object concerned.
        """
        if np.isfinite(self.data).all():
            return
        for obj in self.layout.objects:
            if not np.isfinite(self[obj]).all():
                raise InvalidStateError(f"features of {obj.name} are not finite: {self[obj]}")

    def __getitem__(self, obj: Object) -> Array:
        """Feature vector of an object, shape (..., features)."""
        return self.data[..., self.layout.slices[obj]]

    def get(self, obj: Object, feature: str) -> Array:
        """One feature of an object, shape (...)."""
        value: Array = self.data[..., self.layout.column(obj, feature)]
        return value

    def stack(self, column: Column, feature: str) -> Array:
        """One feature of several objects, shape (..., objects)."""
        return self.data.take(self.layout.indices(column, feature), axis=-1)

    def gather(self, column: Column, features: tuple[str, ...]) -> Array:
        """Several features of several objects, shape (..., objects, features)."""
        return self.data.take(self.layout.grid(column, features), axis=-1)

    def replace(self, changes: Mapping[tuple[Object, str], float]) -> State:
        """The same state with some features changed."""
        data = self.data.copy()
        for (obj, feature), value in changes.items():
            data[..., self.layout.column(obj, feature)] = value
        return State(self.layout, data)

    def over(self, layout: Layout, otherwise: State | None = None) -> State:
        """The features of other objects, in the order of a layout.

        Args:
            layout: Which objects.
            otherwise: A state of ``layout`` with the features of those that this state lacks.

        Raises:
            UnknownObjectError: An object that neither state has.
        """
        if layout is self.layout:
            return self
        parts = []
        for obj in layout.objects:
            source = self if obj in self.layout.slices or otherwise is None else otherwise
            source.layout.object(obj.name)
            parts.append(source[obj])
        return State(layout, np.concatenate(parts, axis=-1))

    @property
    def objects(self) -> tuple[Object, ...]:
        """The objects, in layout order."""
        return self.layout.objects

    @property
    def key(self) -> bytes:
        """The array's bytes: equal exactly for states that are equal to the bit."""
        if self._key is None:
            self._key = self.data.tobytes()
        return self._key

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, State):
            return NotImplemented
        return self.layout == other.layout and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    def __repr__(self) -> str:
        parts = (f"{obj.name}={np.array2string(self[obj], precision=4)}" for obj in self.objects)
        return f"State({', '.join(parts)})"
