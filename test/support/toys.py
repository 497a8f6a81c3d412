# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Toys of many pieces where the blocks of the tower are, about to fall into a heap."""

from __future__ import annotations

import numpy as np

from benchmarks.physics_step import BLOCK, NAMES, tower
from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.relational import State
from slap_ros.worlds.joint_space.scene import TABLE, Mesh, Scene

MASS = 0.01  # kg
TOYS = Scene(
    (
        TABLE,
        *(
            Mesh(name, shape, mass_kg=MASS)
            for name, shape in zip(NAMES, shipped().values(), strict=True)
        ),
    )
)


def heap(rng: np.random.Generator) -> State:
    """Where the tower's blocks are, but higher, and turned at random."""
    state = tower()
    changes = {}
    for level, name in enumerate(NAMES):
        block, turn = BLOCK(name), rng.normal(size=4)
        turn /= np.linalg.norm(turn)
        changes |= {(block, f"q{axis}"): q for axis, q in zip("xyzw", turn.tolist(), strict=True)}
        changes[block, "z"] = float(state.get(block, "z")) + 0.02 * (1 + level)
    return state.replace(changes)
