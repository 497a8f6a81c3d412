# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: types, their features, and where the features are in a state's array."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from slap_ros.domains.tabletop.footprints import HALVES, PARTS, Indices
from slap_ros.domains.tabletop.state_access import HALF_NAMES, JOINT_NAMES
from slap_ros.relational import Column, Feature, Layout, Object, Type
from slap_ros.relational.predicates import Bools
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.features import MATERIAL_FEATURES, ROBOT

CACHE_SIZE = 1024  # columns of objects, for each layout

SIZE_FEATURES = tuple(Feature(name, "m") for name in HALF_NAMES)  # half its edges
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *SIZE_FEATURES), THING)
TARGET = Type("target_block", BLOCK.features, BLOCK)
SURFACE = Type("surface", (*POSE_FEATURES, *SIZE_FEATURES), THING)
TABLE = Type("table", SURFACE.features, SURFACE)
DRAWER = Type("drawer", SURFACE.features, SURFACE)  # its floor
WALL = Type("wall", (*POSE_FEATURES, *SIZE_FEATURES))  # of the drawer; no predicate asks for it
TYPES = (ROBOT, THING, BLOCK, TARGET, SURFACE, TABLE, DRAWER, WALL)


@dataclass(frozen=True, eq=False)
class DrawerObjectIndex:
    """The blocks, target blocks and surfaces of a layout, and where their features are."""

    blocks: tuple[Object, ...]
    targets: tuple[Object, ...]
    surfaces: tuple[Object, ...]
    quaternions: Indices  # (blocks, 4), parts as in PARTS
    places: Indices  # (blocks, 2): x, y
    halves: Indices  # (blocks, 9), as in TO_EDGES
    z: Indices  # (blocks,)
    middles: Indices  # (surfaces, 2): x, y
    levels: Indices  # (surfaces, 4): z and half the edges
    is_drawer: Bools  # (surfaces,)
    joints: Indices  # (7,)
    target_rows: Indices  # (targets,): their positions among the blocks
    is_target: Bools  # (blocks, targets): whether a block is that very target block
    _positions: dict[tuple[Column, ...], Indices] = field(default_factory=dict)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> DrawerObjectIndex:
        """The index of a layout."""
        blocks, surfaces = layout.of_type(BLOCK), layout.of_type(SURFACE)
        targets = layout.of_type(TARGET)

        def columns(objects: Sequence[Object], *features: str) -> Indices:
            return np.array([layout.columns(objects, name) for name in features]).T

        return DrawerObjectIndex(
            blocks,
            targets,
            surfaces,
            quaternions=columns(blocks, *PARTS),
            places=columns(blocks, "x", "y"),
            halves=columns(blocks, *HALVES),
            z=layout.columns(blocks, "z"),
            middles=columns(surfaces, "x", "y"),
            levels=columns(surfaces, "z", *HALF_NAMES),
            is_drawer=np.array([surface.type.is_a(DRAWER) for surface in surfaces]),
            joints=columns(layout.of_type(ROBOT), *JOINT_NAMES).reshape(-1),
            target_rows=np.array([blocks.index(target) for target in targets], dtype=np.intp),
            is_target=np.array([[block == target for target in targets] for block in blocks]),
        )

    def target_positions(self, column: Column) -> Indices:
        """At which positions among the target blocks some of them are."""
        # Of the pairs of each with itself, the position of the other.
        return self.positions(column, column) % max(len(self.targets), 1)

    def positions(self, *columns: Column) -> Indices:
        """At which positions among the blocks some of them are; or among pairs with another.

        Args:
            *columns: Blocks; and then, as long, surfaces or target blocks for pairs.

        Returns:
            Of a block its position; of a pair ``position of the block * number of the others +
            position of the other``.
        """
        positions = self._positions.get(columns)
        if positions is None:
            first, *others = columns
            positions = np.array([self.blocks.index(obj) for obj in first.objects])
            for column in others:
                kind = column.objects[0].type
                among = self.targets if kind.is_a(TARGET) else self.surfaces
                second = np.array([among.index(obj) for obj in column.objects])
                positions = positions * len(among) + second
            if len(self._positions) == CACHE_SIZE:
                self._positions.clear()
            self._positions[columns] = positions
        return positions
