# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: what stands around the robot, as bodies for the physics. Lengths in m."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from slap_ros.domains.cleanup_table.features import BLOCK, HALF, MIDDLE, SURFACE, WALL
from slap_ros.domains.tabletop.planning_scene import PlanningScene
from slap_ros.domains.tabletop.state_access import box_of
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import Solid
from slap_ros.relational import Object, State
from slap_ros.worlds.bodies import WOOD, Colour, Material
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.joint_space.scene import REFERENCE_FRICTION, Box, Mesh, Scene

TABLE_TOP = 0.0
FLOOR_TOP = -0.325
TABLE = OrientedBox(
    Pose((0.5, 0.0, (TABLE_TOP + FLOOR_TOP) / 2)), (0.3, 0.3, (TABLE_TOP - FLOOR_TOP) / 2)
)
BIN = OrientedBox(Pose((0.5, 0.45, -0.275)), (0.3, 0.15, 0.05))
DEEP = 0.3  # of the bin's floor, which reaches into the ground: what falls on it cannot pass it
FLOOR = 0.003  # of the bin over the ground
MATERIAL = Material(
    mass_kg=0.01, friction=REFERENCE_FRICTION
)  # of blocks, unless the state says otherwise

COLOURS: Mapping[str, Colour] = {
    "duck": (0.95, 0.8, 0.2, 1.0),
    "toy_robot": (0.85, 0.3, 0.25, 1.0),
    "dinosaur": (0.35, 0.65, 0.3, 1.0),
    "wiper": (0.25, 0.45, 0.75, 1.0),
}
OTHERS: Colour = (0.6, 0.45, 0.7, 1.0)
TIN: Colour = (0.75, 0.77, 0.8, 1.0)


def kind_of(block: Object) -> str:
    """What a block is: its name less the number that tells it from others of its kind."""
    return block.name.rstrip("0123456789")


def scene_of(state: State, shapes: Mapping[str, Solid]) -> Scene:
    """The bodies of a state: table, bin, and a mesh for each block, in the shape of its kind."""
    bodies: list[Box | Mesh] = []
    for surface in state.layout.of_type(SURFACE):
        pose, half = box_of(state, surface)
        if state.get(surface, "is_drawer") > 0.5:
            bodies += [
                Box(f"{surface.name}_{part}", size, colour=TIN, pose=pose.compose(frame))
                for part, (frame, size) in _parts(half).items()
            ]
        else:
            bodies.append(Box(surface.name, half, colour=WOOD))
    for block in state.layout.of_type(BLOCK):
        kind = kind_of(block)
        colour = COLOURS.get(kind, OTHERS)
        bodies.append(Mesh(block.name, shapes[kind], colour=colour).with_material(MATERIAL))
    return Scene(tuple(bodies), floor_m=FLOOR_TOP)


def _parts(half: Vector) -> Mapping[str, OrientedBox]:
    """Floor and walls of a bin, in its own frame."""
    x, y, z = half
    thin = WALL / 2
    return {
        "floor": OrientedBox(Pose((0.0, 0.0, FLOOR - z - DEEP / 2)), (x, y, DEEP / 2)),
        "front": OrientedBox(Pose((x - thin, 0.0, 0.0)), (thin, y, z)),
        "back": OrientedBox(Pose((thin - x, 0.0, 0.0)), (thin, y, z)),
        "left": OrientedBox(Pose((0.0, y - thin, 0.0)), (x, thin, z)),
        "right": OrientedBox(Pose((0.0, thin - y, 0.0)), (x, thin, z)),
    }


def solid(state: State) -> Iterable[tuple[Object, OrientedBox]]:
    """The boxes that things fill: a block, the box around it."""
    for block in state.layout.of_type(BLOCK):
        yield block, carried(state, block).at(pose_of(state, block))
    for surface in state.layout.of_type(SURFACE):
        pose, half = box_of(state, surface)
        if state.get(surface, "is_drawer") > 0.5:
            for part in _parts(half).values():
                yield surface, part.at(pose)
        else:
            yield surface, OrientedBox(pose, half)


def carried(state: State, block: Object) -> OrientedBox:
    """The box around a block, in its own frame."""
    x, y, z, u, v, w = (float(state.get(block, name)) for name in (*MIDDLE, *HALF))
    return OrientedBox(Pose((x, y, z)), (u, v, w))


PLANNING_SCENE = PlanningScene(solid, carried)
