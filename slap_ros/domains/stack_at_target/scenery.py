# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: cubes, and low blocks of fixed place that are the targets. Lengths in m."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from slap_ros.domains.benchtop.features import place_features, thing_features
from slap_ros.domains.stack_at_target.model import CUBE, TARGET
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import Layout, State
from slap_ros.worlds.contact.scene import TABLE, Compound, ContactScene, box

CUBE_HALF = 0.02
TARGET_HALF = (0.03, 0.03, 0.015)  # higher than the lift from which on a cube is held
CUBE_MASS = 0.1  # kg
COLOURS = (
    (0.85, 0.2, 0.2, 1.0),
    (0.2, 0.4, 0.85, 1.0),
    (0.95, 0.75, 0.2, 1.0),
    (0.55, 0.35, 0.75, 1.0),
    (0.3, 0.7, 0.7, 1.0),
)
GREEN = (0.35, 0.65, 0.35, 1.0)


def scene_of(state: State) -> ContactScene:
    """The bodies of a state."""
    return _scene(state.layout)


@lru_cache(maxsize=64)
def _scene(layout: Layout) -> ContactScene:
    targets = (box(target.name, TARGET_HALF, colour=GREEN) for target in layout.of_type(TARGET))
    cubes = (_cube(i, cube.name) for i, cube in enumerate(layout.of_type(CUBE)))
    return ContactScene((TABLE, *targets, *cubes))


def _cube(number: int, name: str) -> Compound:
    colour = COLOURS[number % len(COLOURS)]
    return box(name, (CUBE_HALF,) * 3, mass_kg=CUBE_MASS, colour=colour)


def cube_features(x: float, y: float, yaw: float, under: float = 0.0) -> Mapping[str, float]:
    """A cube's features where it stands.

    Args:
        x: X of the cube, m.
        y: Y of the cube, m.
        yaw: Yaw of the cube, rad.
        under: Height of what it stands on, m.

    Returns:
        By name, for ``State.build``.
    """
    pose = Pose((x, y, under + CUBE_HALF), from_yaw(yaw))
    return thing_features(pose, rest_height=CUBE_HALF, support_height=CUBE_HALF)


def target_features(x: float, y: float) -> Mapping[str, float]:
    """A target's features where it stands, m, by name, for ``State.build``."""
    half = TARGET_HALF[2]
    return place_features(Pose((x, y, half)), support_height=half)
