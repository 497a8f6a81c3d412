# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: what stands around the robot, as bodies for the physics."""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Vector
from slap_ros.relational import Object, State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.joint_space.scene import CUBE_MATERIAL, TABLE, Box, Scene, cube

RED: Colour = (0.85, 0.25, 0.2, 1.0)
BLUE: Colour = (0.3, 0.45, 0.75, 1.0)
GREEN: Colour = (0.3, 0.7, 0.35, 1.0)


def scene_of(state: State) -> Scene:
    """The bodies of a state: the table, plates for the targets, cubes; target blocks are red."""
    return _scene(state, lambda block, colour: cube(block.name, colour))


def sized_scene_of(state: State) -> Scene:
    """The same with cubes as large as the state says, which may differ.

    Raises:
        InvalidStateError: A cube has no size.
    """
    return _scene(state, lambda block, colour: _sized_cube(state, block, colour))


def _scene(state: State, body_of: Callable[[Object, Colour], Box]) -> Scene:
    """The bodies of a state, with those of blocks as ``body_of`` makes them."""
    surfaces = state.layout.of_type(SURFACE)
    targets = [surface for surface in surfaces if state.get(surface, "is_target") > 0.5]
    plates = [
        Box(target.name, _halves(state, target), colour=GREEN, solid=False) for target in targets
    ]
    blocks = [
        body_of(block, RED if number < len(targets) else BLUE)
        for number, block in enumerate(state.layout.of_type(BLOCK))
    ]
    return Scene((TABLE, *plates, *blocks))


def _sized_cube(state: State, block: Object, colour: Colour) -> Box:
    halves = _halves(state, block)
    if min(halves) <= 0.0:
        raise InvalidStateError(f"{block.name} has half edges of {halves} m; each must be above 0")
    return Box(block.name, halves, colour=colour).with_material(CUBE_MATERIAL)


def _halves(state: State, thing: Object) -> Vector:
    x, y, z = (float(state.get(thing, f"half_{axis}")) for axis in ("x", "y", "z"))
    return x, y, z
