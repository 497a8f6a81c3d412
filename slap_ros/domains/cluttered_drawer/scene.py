# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: what stands around the robot, and as bodies for the physics. Lengths in m.

The drawer is open towards the robot by 25 cm, as the reference's; the table's front closes its
back. It is shallow: a hand around a block in it is clear of its walls and of the table, however it
is turned, and only what is between the fingers counts.
"""

from __future__ import annotations

from collections.abc import Mapping

from slap_ros.domains.cluttered_drawer.features import BLOCK, DRAWER, TABLE, TARGET, WALL
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.relational import Object, State
from slap_ros.worlds.bodies import WOOD, Colour
from slap_ros.worlds.joint_space import scene
from slap_ros.worlds.joint_space.scene import TABLE_TOP, Box, Scene, cube

RED: Colour = (0.85, 0.25, 0.2, 1.0)
BLUE: Colour = (0.3, 0.45, 0.75, 1.0)
PALE: Colour = (0.85, 0.75, 0.62, 1.0)

FRONT = 0.55  # x of the table's front
OPENING = 0.25  # along x, between the drawer's front and the table's
HALF_WIDTH = 0.36  # of the drawer inside, along y
BOTTOM = 0.025  # z of the drawer's floor: a block in it is as high as the table
WALL_HEIGHT = 0.04
THICK = 0.012  # half, of floor and walls
MIDDLE = FRONT - OPENING / 2  # x of the drawer

_table_half = scene.TABLE.half_extents_m
_long = OPENING / 2 + THICK  # half, with the front wall's thickness
_wide = HALF_WIDTH + 2 * THICK
_centre = FRONT - _long  # x
_wall_z = BOTTOM + WALL_HEIGHT / 2
_beside = HALF_WIDTH + THICK  # y

FIXED: Mapping[Object, tuple[Vector, Vector]] = {  # middles, and half their edges
    TABLE("table"): (
        (FRONT + _table_half[0], 0.0, TABLE_TOP - _table_half[2]),
        _table_half,
    ),
    DRAWER("drawer"): ((MIDDLE, 0.0, BOTTOM - THICK), (OPENING / 2, HALF_WIDTH, THICK)),
    WALL("front_wall"): (
        (FRONT - OPENING - THICK, 0.0, _wall_z),
        (THICK, _wide, WALL_HEIGHT / 2),
    ),
    WALL("left_wall"): ((_centre, _beside, _wall_z), (_long, THICK, WALL_HEIGHT / 2)),
    WALL("right_wall"): ((_centre, -_beside, _wall_z), (_long, THICK, WALL_HEIGHT / 2)),
}
COLOURS: Mapping[str, Colour] = {"table": WOOD}


def scene_of(state: State) -> Scene:
    """The bodies of a state; the target block is red."""
    bodies = [
        Box(obj.name, half, colour=COLOURS.get(obj.name, PALE), pose=Pose(middle))
        for obj, (middle, half) in FIXED.items()
    ]
    bodies += [
        cube(block.name, RED if block.type.is_a(TARGET) else BLUE)
        for block in state.layout.of_type(BLOCK)
    ]
    return Scene(tuple(bodies))
