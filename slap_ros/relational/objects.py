# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Types and the objects that have them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

# The layout asked last, and the indices of what was asked of it, by feature.
IndexCache = tuple[object, dict[Any, NDArray[np.intp]]]


@dataclass(frozen=True)
class Feature:
    """One entry of a feature vector."""

    name: str
    unit: str  # SI: m, rad, m/s, ...; "1" for a pure number


@dataclass(frozen=True)
class Type:
    """A type of object; it lays out the feature vector of its objects."""

    name: str
    features: tuple[Feature, ...] = ()
    parent: Type | None = None

    @cached_property
    def column(self) -> dict[str, int]:
        """Position of each feature in the vector, by name."""
        return {feature.name: i for i, feature in enumerate(self.features)}

    def is_a(self, other: Type) -> bool:
        """Whether this type is ``other`` or descends from it."""
        if self == other or (self.parent is not None and self.parent.is_a(other)):
            return True
        return other.includes(self)

    def overlaps(self, other: Type) -> bool:
        """Whether an object can be of both types."""
        return self.is_a(other) or other.is_a(self)

    def includes(self, other: Type) -> bool:
        """Whether this type has ``other`` among its alternatives; a plain type has none."""
        return self == other

    def __hash__(self) -> int:
        # As for objects: the name tells types apart, and types are looked up in every step.
        return hash(self.name)

    def __call__(self, name: str) -> Object:
        """An object of this type."""
        return Object(name, self)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, eq=False)
class Column:
    """Objects side by side, for asking the same of all of them at once."""

    objects: tuple[Object, ...]
    _cache: IndexCache = field(default=(None, {}), init=False, repr=False)

    @staticmethod
    @lru_cache(maxsize=256)  # so that its indices are kept, too
    def of(obj: Object) -> Column:
        """A column of one object.

        Args:
            obj: The object.
        """
        return Column((obj,))

    def cached_indices(self, layout: object) -> dict[Any, NDArray[np.intp]]:
        """A layout's cache for this column; kept with the column, as layouts outlive episodes.

        A column is as good as always asked about by the same layout, so only the latest one's
        cache is kept.
        """
        cache = self._cache  # read once: threads may compute twice, but never mix up layouts
        if cache[0] is not layout:
            cache = (layout, {})
            object.__setattr__(self, "_cache", cache)
        return cache[1]


@dataclass(frozen=True)
class Object:
    """A named thing; names are unique within a task."""

    name: str
    type: Type

    def __hash__(self) -> int:
        # The name tells the objects of a task apart; hashing the type too would only cost time.
        return hash(self.name)

    def __str__(self) -> str:
        return self.name
