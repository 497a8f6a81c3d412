# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bodies around the robot, described once, as data that a domain owns."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from slap_ros.errors import InvalidDomainError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import Solid
from slap_ros.worlds.bodies import GREY, WOOD, Colour, Material, RigidBody

Shape = Vector | Solid  # half the edges of a box, m; or convex pieces

REFERENCE_FRICTION = 0.9  # 1, the reference's, of everything it has


@dataclass(frozen=True)
class Box(RigidBody):
    """A body in the shape of a cuboid.

    Args:
        half_extents_m: Half the edges along x, y, z of the box's own frame, m.
    """

    half_extents_m: Vector
    friction: float = field(default=REFERENCE_FRICTION, kw_only=True)

    def at(self, pose: Pose) -> OrientedBox:
        """The space that the box fills at a pose."""
        return OrientedBox(pose, self.half_extents_m)

    def cores(self, pose: Pose) -> tuple[OrientedBox, ...]:
        """Boxes inside the box at a pose."""
        return (self.at(pose),)

    @property
    def shape(self) -> Shape:
        """Half the edges, m, as the key of the shape: boxes of one size have the same key."""
        return self.half_extents_m

    def extent(self, axis: Vector) -> float:
        """How far the box reaches from its origin along a unit vector, m."""
        return sum(abs(a) * half for a, half in zip(axis, self.half_extents_m, strict=True))

    def stands_on(self, down: Vector) -> bool:
        """Whether the box stands on a plane without turning, with an axis of its own downwards."""
        del down
        return True


@dataclass(frozen=True)
class Mesh(RigidBody):
    """A body of convex pieces, whose origin is its centre of mass; the mass is spread evenly.

    Args:
        shape: Solid of the body: its pieces. Meshes of one shape share it.
    """

    shape: Solid
    friction: float = field(default=REFERENCE_FRICTION, kw_only=True)

    def at(self, pose: Pose) -> OrientedBox:
        """A box around the mesh at a pose: the space that the arm takes it to fill."""
        return self.shape.bounds.at(pose)

    def cores(self, pose: Pose) -> tuple[OrientedBox, ...]:
        """Boxes inside the mesh at a pose."""
        return tuple(core.at(pose) for core in self.shape.cores)

    def extent(self, axis: Vector) -> float:
        """How far the mesh reaches from its origin along a unit vector, m."""
        return self.shape.extent(axis)

    def stands_on(self, down: Vector) -> bool:
        """Whether the mesh stands on a plane without turning, with an axis of its own downwards."""
        return self.shape.stands_on(down)


Body = Box | Mesh

CUBE_EDGE = 0.05  # m
CUBE_MATERIAL = Material(mass_kg=0.5, friction=REFERENCE_FRICTION)
TABLE = Box("table", (0.25, 0.4, 0.25), colour=WOOD, pose=Pose((0.5, 0.0, -0.175)))
TABLE_TOP = 0.075  # m
FLOOR_TOP = -0.425  # m


def cube(name: str, colour: Colour = GREY) -> Box:
    """The reference's 5 cm cube."""
    return Box(name, (CUBE_EDGE / 2,) * 3, colour=colour).with_material(CUBE_MATERIAL)


@dataclass(frozen=True)
class Scene:
    """All bodies around a Panda whose base is at the origin.

    Args:
        bodies: Bodies of the scene, free and fixed; the order of the free ones is part of the
            physics.
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
