# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: the types of things, and where a state has their features."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from operator import itemgetter
from typing import Any

import numpy as np

from slap_ros.domains.tabletop.footprints import HALVES, PARTS, Indices
from slap_ros.domains.tabletop.state_access import HALF_NAMES
from slap_ros.physics.features import BODY_FEATURES, MATERIAL_FEATURES, POSE_FEATURES
from slap_ros.relational import Column, Feature, Layout, Object, Type

CACHE_SIZE = 1024  # columns of objects, a layout

Asked = Column | tuple[Column, Column]
Read = Callable[[Sequence[float]], tuple[Any, ...]]

# Of blocks and surfaces alike, so that predicates can ask both at once.
THING_FEATURES = (
    *(Feature(edge, "m") for edge in HALF_NAMES),
    Feature("is_movable", "1"),
    Feature("is_target", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *THING_FEATURES), THING)
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)


@dataclass(frozen=True, eq=False)
class TowerObjectIndex:
    """The blocks, then the surfaces of a layout, and where their features are."""

    blocks: int  # how many
    objects: tuple[Object, ...]
    quaternions: Indices  # (things, 4), parts as read
    places: Indices  # (things, 2): x, y
    halves: Indices  # (things, 9), as in TO_EDGES
    z: Indices  # (things,), as the labels
    is_movable: Indices
    is_target: Indices
    held: Indices  # (blocks,)
    boxes: tuple[Read, ...]  # of each, what a ScalarBox is made of
    _numbers: dict[Asked, Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> TowerObjectIndex:
        """Those of a layout."""
        blocks = layout.of_type(BLOCK)
        objects = (*blocks, *layout.of_type(SURFACE))

        def where(*features: str) -> Indices:
            return np.array([layout.columns(objects, name) for name in features])

        def box(obj: Object) -> Read:
            names = ("x", "y", "z", *PARTS, *HALF_NAMES)
            return itemgetter(*(layout.column(obj, name) for name in names))

        return TowerObjectIndex(
            len(blocks),
            objects,
            quaternions=where(*PARTS).T,
            places=where("x", "y").T,
            halves=where(*HALVES).T,
            z=where("z")[0],
            is_movable=where("is_movable")[0],
            is_target=where("is_target")[0],
            held=layout.columns(blocks, "held"),
            boxes=tuple(box(obj) for obj in objects),
        )

    def numbers(self, column: Column) -> Indices:
        """The objects of a column as numbers."""
        numbers = self._numbers.get(column)
        if numbers is None:
            numbers = np.array([self.objects.index(obj) for obj in column.objects])
            self._remember(column, numbers)
        return numbers

    def pairs(self, blocks: Column, things: Column) -> Indices:
        """The numbers of pairs of a block and a thing."""
        pairs = self._numbers.get((blocks, things))
        if pairs is None:
            pairs = self.numbers(blocks) * len(self.objects) + self.numbers(things)
            self._remember((blocks, things), pairs)
        return pairs

    def _remember(self, asked: Asked, numbers: Indices) -> None:
        if len(self._numbers) == CACHE_SIZE:
            self._numbers.clear()
        self._numbers[asked] = numbers
