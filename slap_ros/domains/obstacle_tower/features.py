# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: types, their features, and where the features are in a state's array."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from slap_ros.domains.tabletop.footprints import HALVES, PARTS, Indices
from slap_ros.domains.tabletop.state_access import HALF_NAMES
from slap_ros.relational import Column, Feature, Layout, Object, Type
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.features import MATERIAL_FEATURES, ROBOT

CACHE_SIZE = 1024  # columns of objects, for each layout

Asked = Column | tuple[Column, Column]

# Of blocks and surfaces alike, so that predicates can ask both at once.
THING_FEATURES = (
    *(Feature(edge, "m") for edge in HALF_NAMES),
    Feature("is_movable", "1"),
    Feature("is_target", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *THING_FEATURES), THING)
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, SURFACE)


@dataclass(frozen=True, eq=False)
class TowerObjectIndex:
    """The things of a layout, blocks before surfaces, and where their features are."""

    blocks: int  # how many
    things: tuple[Object, ...]
    quaternions: Indices  # (things, 4), parts as read
    places: Indices  # (things, 2): x, y
    halves: Indices  # (things, 9), as in TO_EDGES
    z: Indices  # (things,), as the labels
    is_movable: Indices
    is_target: Indices
    held: Indices  # (blocks,)
    boxes: Indices  # (things, 10), arguments of a ScalarBox
    _positions: dict[Asked, Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> TowerObjectIndex:
        """The index of a layout."""
        blocks = layout.of_type(BLOCK)
        things = (*blocks, *layout.of_type(SURFACE))

        def columns(*features: str) -> Indices:
            return np.array([layout.columns(things, name) for name in features])

        return TowerObjectIndex(
            len(blocks),
            things,
            quaternions=columns(*PARTS).T,
            places=columns("x", "y").T,
            halves=columns(*HALVES).T,
            z=columns("z")[0],
            is_movable=columns("is_movable")[0],
            is_target=columns("is_target")[0],
            held=layout.columns(blocks, "held"),
            boxes=columns("x", "y", "z", *PARTS, *HALF_NAMES).T,
        )

    def positions(self, column: Column) -> Indices:
        """At which positions among the things those of a column are."""
        positions = self._positions.get(column)
        if positions is None:
            positions = np.array([self.things.index(obj) for obj in column.objects])
            self._cache(column, positions)
        return positions

    def pairs(self, blocks: Column, things: Column) -> Indices:
        """``position of the block * number of things + position of the thing``, for each pair."""
        pairs = self._positions.get((blocks, things))
        if pairs is None:
            pairs = self.positions(blocks) * len(self.things) + self.positions(things)
            self._cache((blocks, things), pairs)
        return pairs

    def _cache(self, asked: Asked, positions: Indices) -> None:
        if len(self._positions) == CACHE_SIZE:
            self._positions.clear()
        self._positions[asked] = positions
