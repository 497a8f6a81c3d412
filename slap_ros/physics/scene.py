# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands around the robot, described once, as data that a domain owns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from slap_ros.errors import InvalidDomainError
from slap_ros.physics.boxes import OrientedBox
from slap_ros.physics.pose import IDENTITY, Pose, Vector

Colour = tuple[float, float, float, float]  # red green blue opacity, 0 to 1

FRICTION = 0.9  # 1, the reference's, of everything it has
GREY: Colour = (0.6, 0.6, 0.6, 1.0)
WOOD: Colour = (0.72, 0.6, 0.47, 1.0)


@dataclass(frozen=True)
class Box:
    """A cuboid.

    Args:
        name: That of the object in the state which it embodies.
        half_extents_m: Half its edges along x, y, z of its own frame.
        mass_kg: 0 for a body that is fixed.
        friction: Coulomb's coefficient; that of a pair of bodies is the product of both.
        colour: For pictures.
        pose: Where a fixed body stands, unless the state has pose features for it. A free body
            is always where the state says.
        solid: False for what only marks a place: nothing touches it.
    """

    name: str
    half_extents_m: Vector
    mass_kg: float = 0.0
    friction: float = FRICTION
    colour: Colour = GREY
    pose: Pose = IDENTITY
    solid: bool = True

    def at(self, pose: Pose) -> OrientedBox:
        """The space it fills at a pose."""
        return OrientedBox(pose, self.half_extents_m)


Body = Box  # the union of all kinds of bodies; meshes will be the next

CUBE_EDGE = 0.05  # m
CUBE_MASS = 0.5  # kg
TABLE = Box("table", (0.25, 0.4, 0.25), colour=WOOD, pose=Pose((0.5, 0.0, -0.175)))
TABLE_TOP = 0.075  # m
FLOOR_TOP = -0.425  # m


def cube(name: str, colour: Colour = GREY) -> Box:
    """The reference's 5 cm cube."""
    return Box(name, (CUBE_EDGE / 2,) * 3, CUBE_MASS, colour=colour)


@dataclass(frozen=True)
class Scene:
    """All bodies around a Panda whose base is at the origin.

    Args:
        bodies: Free and fixed ones; the order of the free ones is part of the physics.
        floor_m: Height of the floor, which catches what falls off the table.

    Raises:
        InvalidDomainError: Two bodies share a name, or a free one is not solid.
    """

    bodies: tuple[Body, ...]
    floor_m: float = FLOOR_TOP

    def __post_init__(self) -> None:
        names = [body.name for body in self.bodies]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise InvalidDomainError(f"a scene has two bodies named {', '.join(twice)}")
        if ghosts := [body.name for body in self.free if not body.solid]:
            raise InvalidDomainError(f"free bodies must be solid, not so {', '.join(ghosts)}")

    @cached_property
    def free(self) -> tuple[Body, ...]:
        """The bodies that move."""
        return tuple(body for body in self.bodies if body.mass_kg > 0)

    @cached_property
    def fixed(self) -> tuple[Body, ...]:
        """The bodies that do not, the floor last."""
        half_depth = 0.5  # m
        floor = Box(
            "floor", (5.0, 5.0, half_depth), pose=Pose((0.0, 0.0, self.floor_m - half_depth))
        )
        return (*(body for body in self.bodies if body.mass_kg == 0), floor)
