# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tower, of blocks whose mass and friction the state says."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.physics_step import BLOCK, NAMES, tower
from slap_ros.relational import State, Type
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import BODY_FEATURES
from slap_ros.worlds.joint_space.features import MATERIAL_FEATURES, material_features
from slap_ros.worlds.joint_space.scene import CUBE_MATERIAL

MADE_BLOCK = Type("block", (*BODY_FEATURES, *MATERIAL_FEATURES))


def tower_of(materials: Mapping[str, Material]) -> State:
    """The tower, of these materials; the reference's where none is given."""
    state = tower()
    features = {}
    for obj in state.objects:
        known = {f.name: float(state.get(obj, f.name)) for f in obj.type.features}
        if obj.type == BLOCK:
            obj = MADE_BLOCK(obj.name)
            known |= material_features(materials.get(obj.name, CUBE_MATERIAL))
        features[obj] = known
    return State.build(features)


def mixed(rng: np.random.Generator) -> State:
    """The tower, each block from feather to lead and from ice to rubber."""
    return tower_of(
        {n: Material(float(np.exp(rng.uniform(-3, 1))), rng.uniform(0.0, 1.5)) for n in NAMES}
    )
