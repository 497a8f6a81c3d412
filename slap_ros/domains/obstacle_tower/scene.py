# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: what stands around the robot, as bodies for the physics."""

from __future__ import annotations

from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.relational import State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.joint_space.scene import TABLE, Box, Scene, cube

RED: Colour = (0.85, 0.25, 0.2, 1.0)
BLUE: Colour = (0.3, 0.45, 0.75, 1.0)
GREEN: Colour = (0.3, 0.7, 0.35, 1.0)


def scene_of(state: State) -> Scene:
    """The bodies of a state: the table, plates for the targets, cubes; target blocks are red."""
    surfaces = state.layout.of_type(SURFACE)
    targets = [surface for surface in surfaces if state.get(surface, "is_target") > 0.5]
    bodies = [TABLE]
    for target in targets:
        x, y, z = (float(state.get(target, f"half_{axis}")) for axis in ("x", "y", "z"))
        bodies.append(Box(target.name, (x, y, z), colour=GREEN, solid=False))
    for number, block in enumerate(state.layout.of_type(BLOCK)):
        bodies.append(cube(block.name, RED if number < len(targets) else BLUE))
    return Scene(tuple(bodies))
