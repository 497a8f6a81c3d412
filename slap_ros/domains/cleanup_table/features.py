# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: types, their features, and where the features are in a state's array."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from slap_ros.relational import Column, Feature, Layout, Type
from slap_ros.relational.predicates import Bools
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.features import MATERIAL_FEATURES, ROBOT

WALL = 0.005  # m, thickness of the bin's walls

# Of blocks and surfaces alike: a box around the thing in the thing's own frame.
THING_FEATURES = (
    *(Feature(f"half_{axis}", "m") for axis in ("x", "y", "z")),  # half its edges
    *(Feature(f"middle_{axis}", "m") for axis in ("x", "y", "z")),  # its middle
    Feature("is_movable", "1"),
    Feature("is_drawer", "1"),
)
THING = Type("thing")
BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES, *THING_FEATURES), THING)
TOOL = Type("tool", BLOCK.features, BLOCK)  # the wiper: what is learned with it is not with a toy
SURFACE = Type("surface", (*POSE_FEATURES, *THING_FEATURES), THING)
TYPES = (ROBOT, THING, BLOCK, TOOL, SURFACE)

POSITION = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
VELOCITY = ("vx", "vy", "vz")
HALF = ("half_x", "half_y", "half_z")
MIDDLE = ("middle_x", "middle_y", "middle_z")

Indices = NDArray[np.intp]
BLOCK_READ = (*POSITION, *QUATERNION, *VELOCITY, "held", *HALF, *MIDDLE)
SURFACE_READ = ("x", "y", "qw", "qz", "z", *HALF, "is_drawer")  # complex numbers first


@dataclass(frozen=True, eq=False)
class CleanupObjectIndex:
    """The blocks and surfaces of a layout, and where their features are."""

    blocks: Column
    surfaces: Column
    block_columns: Indices  # (blocks, BLOCK_READ)
    surface_columns: Indices  # (surfaces, SURFACE_READ)
    others: Bools  # of each block, shape (blocks, blocks)

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> CleanupObjectIndex:
        """The index of a layout."""
        blocks, surfaces = layout.column_of(BLOCK), layout.column_of(SURFACE)
        return CleanupObjectIndex(
            blocks,
            surfaces,
            layout.grid(blocks, BLOCK_READ),
            layout.grid(surfaces, SURFACE_READ),
            ~np.eye(len(blocks.objects), dtype=bool),
        )

    @staticmethod
    @lru_cache(maxsize=4096)
    def positions(among: Column, column: Column) -> Indices:
        """At which positions of a column the objects of another are."""
        return np.array([among.objects.index(obj) for obj in column.objects], dtype=np.intp)
