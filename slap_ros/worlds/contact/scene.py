# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What there is around the hand, as data that a domain owns: rigid bodies and jointed ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

from slap_ros.errors import InvalidDomainError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import (
    IDENTITY,
    ORIGIN,
    Pose,
    Vector,
    conjugate,
    cross,
    dot,
    from_rotation_vector,
    from_yaw,
    rotate,
)
from slap_ros.worlds.bodies import GREY, WOOD, Colour, RigidBody
from slap_ros.worlds.contact.hand_model import QUICK, HandModel

THING_FRICTION = 1.0  # 1; that of a pair of bodies is the product of both
TABLE_FRICTION = 0.9  # 1
TURNS = tuple(from_yaw(math.radians(turn)) for turn in (0.0, 22.5, 45.0, 67.5))  # deg
INSCRIBED = math.sqrt(0.5)  # half the edge of the square inside a circle of radius 1


@dataclass(frozen=True)
class BoxPart:
    """A cuboid of a body.

    Args:
        half_extents_m: Half the edges along x, y, z of the box's own frame, m.
        pose: Pose in the frame of what the box is a part of.
        colour: Colour of the part, in place of the body's.
    """

    half_extents_m: Vector
    pose: Pose = IDENTITY
    colour: Colour | None = None

    @cached_property
    def bounding_box(self) -> OrientedBox:
        """The smallest box around the part."""
        return OrientedBox(self.pose, self.half_extents_m)

    @cached_property
    def bounding_boxes(self) -> tuple[OrientedBox, ...]:
        """Boxes around the part; what is outside of one of them does not touch it."""
        return (self.bounding_box,)

    @property
    def inner_box(self) -> OrientedBox:
        """A box inside the part."""
        return self.bounding_box

    @property
    def volume_m3(self) -> float:
        """Volume of the part, m³."""
        return 8.0 * math.prod(self.half_extents_m)

    @property
    def inertia_per_kg(self) -> Vector:
        """Inertia about the axes through the part's middle for a mass of 1 kg, m²."""
        x, y, z = (half * half / 3.0 for half in self.half_extents_m)
        return (y + z, x + z, x + y)


@dataclass(frozen=True)
class CylinderPart:
    """A cylinder of a body; its axis is its own z.

    Args:
        radius_m: Radius of the round section, m.
        length_m: Length from end to end, m.
        pose: Pose in the frame of what the cylinder is a part of.
        colour: Colour of the part, in place of the body's.
    """

    radius_m: float
    length_m: float
    pose: Pose = IDENTITY
    colour: Colour | None = None

    @cached_property
    def bounding_box(self) -> OrientedBox:
        """The smallest box around the cylinder."""
        return OrientedBox(self.pose, (self.radius_m, self.radius_m, 0.5 * self.length_m))

    @cached_property
    def bounding_boxes(self) -> tuple[OrientedBox, ...]:
        """Boxes around the cylinder; what is outside of one of them does not touch it.

        Each is turned about the axis: a single one's corners are 1.4 radii away from it, what is
        inside all of them is 1.02 at most.
        """
        pose, half = self.bounding_box
        return tuple(OrientedBox(pose.compose(Pose(quaternion=turn)), half) for turn in TURNS)

    @property
    def inner_box(self) -> OrientedBox:
        """A box inside the cylinder."""
        half = INSCRIBED * self.radius_m
        return OrientedBox(self.pose, (half, half, 0.5 * self.length_m))

    @property
    def volume_m3(self) -> float:
        """Volume of the cylinder, m³."""
        return math.pi * self.radius_m**2 * self.length_m

    @property
    def inertia_per_kg(self) -> Vector:
        """Inertia about the axes through the cylinder's middle for a mass of 1 kg, m²."""
        across = self.radius_m**2 / 4.0 + self.length_m**2 / 12.0
        return (across, across, self.radius_m**2 / 2.0)


Part = BoxPart | CylinderPart


@dataclass(frozen=True)
class Compound(RigidBody):
    """A body of one part or of several, that may overlap; its origin is its centre of mass.

    Args:
        parts: Parts of the body.
    """

    parts: tuple[Part, ...]
    friction: float = field(default=THING_FRICTION, kw_only=True)

    @cached_property
    def bounding_box(self) -> OrientedBox:
        """The box around the body in its own frame, along the axes of that frame."""
        return bounding_box(self.parts)

    def at(self, pose: Pose) -> OrientedBox:
        """The box around the body at a pose."""
        return self.bounding_box.at(pose)

    def cores(self, pose: Pose) -> tuple[OrientedBox, ...]:
        """Boxes inside the body at a pose."""
        return _inner_boxes(self.parts, pose)

    def stands_on(self, down: Vector) -> bool:
        """Whether the body stands on a plane without turning, as the box around it does."""
        del down
        return True

    @cached_property
    def inertia(self) -> Vector:
        """Inertia about the axes of the body's frame, kg m²; parts weigh by their volumes."""
        return inertia(self.parts, self.mass_kg, ORIGIN)

    def extent(self, axis: Vector) -> float:
        """How far the body reaches from its origin along a unit vector, m."""
        return max(_extent(part.bounding_box, axis) for part in self.parts)


class JointKind(Enum):
    """How the moving part of a jointed body moves; the value is URDF's word."""

    SLIDE = "prismatic"
    TURN = "revolute"


@dataclass(frozen=True)
class Joint:
    """What joins the moving part of a body to its frame.

    Its opening is 0 where it is closed: in m if it slides, in rad if it turns.

    Args:
        kind: Kind of the joint: whether it slides along the axis or turns about it.
        axis: Axis as a unit vector in the joint's own frame.
        high: Largest opening, m or rad; the least is 0.
        mount: Pose of the joint's frame in the body's.
        damping: Damping, N s/m or N m s/rad.
        dry_friction: Force or moment that it takes to move the joint at all, N or N m.
    """

    kind: JointKind
    axis: Vector
    high: float
    mount: Pose = IDENTITY
    damping: float = 0.0
    dry_friction: float = 0.0

    def moved(self, opening: float) -> Pose:
        """The moving part's frame in the body's."""
        x, y, z = self.axis
        way = (opening * x, opening * y, opening * z)
        slides = self.kind is JointKind.SLIDE
        return self.mount.compose(Pose(way) if slides else Pose(ORIGIN, from_rotation_vector(way)))

    def opening_at(self, moved: Pose) -> float:
        """The opening at which the moving part is nearest to a pose: what :meth:`moved` undoes.

        Args:
            moved: Pose of the moving part's frame in the body's.

        Returns:
            m, or rad within half a turn of the middle of the range; outside the range as well.
        """
        position, (x, y, z, w) = self.mount.inverse().compose(moved)
        if self.kind is JointKind.SLIDE:
            return dot(self.axis, position)
        turn, middle = 2.0 * math.atan2(dot(self.axis, (x, y, z)), w), 0.5 * self.high
        return middle + math.remainder(turn - middle, math.tau)


@dataclass(frozen=True)
class JointedBody:
    """A fixed frame and a part that slides or turns in it: a drawer, a lid.

    The two do not touch one another: leave the room that a real one has.

    Args:
        name: Name of the body, which is that of its object in the state.
        frame: Parts that stand still, in the body's frame.
        moving: Parts that move, in the joint's frame at opening 0.
        joint: Joint that moves the moving parts.
        mass_kg: Mass of the moving part, kg.
        friction: Coefficient of friction; see :class:`Compound`.
        colour: Colour of the frame.
        moving_colour: Colour of the moving part.
        pose: Pose of the body, unless the state has pose features for it.
    """

    name: str
    frame: tuple[Part, ...]
    moving: tuple[Part, ...]
    joint: Joint
    mass_kg: float
    friction: float = THING_FRICTION
    colour: Colour = GREY
    moving_colour: Colour = WOOD
    pose: Pose = IDENTITY

    @cached_property
    def moving_box(self) -> OrientedBox:
        """The box around the moving part in its own frame."""
        return bounding_box(self.moving)

    @cached_property
    def lever_m(self) -> float:
        """How far the fastest point goes while the body opens by 1: 1 m, or m per rad."""
        if self.joint.kind is JointKind.SLIDE:
            return 1.0
        corners = (corner for part in self.moving for corner in part.bounding_box.corners())
        return max(math.dist(cross(self.joint.axis, corner), ORIGIN) for corner in corners)

    def moving_pose(self, pose: Pose, opening: float) -> Pose:
        """Where the moving part's frame is when the body stands at ``pose``."""
        return pose.compose(self.joint.moved(opening))

    def cores(self, pose: Pose, opening: float) -> tuple[OrientedBox, ...]:
        """Boxes inside frame and moving part."""
        moving = self.moving_pose(pose, opening)
        return (*_inner_boxes(self.frame, pose), *_inner_boxes(self.moving, moving))


Body = Compound | JointedBody


@dataclass(frozen=True)
class ContactScene:
    """All bodies around a Panda whose base is at the origin.

    Args:
        bodies: Bodies of the scene. The order of those that move is part of the physics.
        hand: What the hand can do.
        floor_m: Height of the floor, which catches what falls off the table.

    Raises:
        InvalidDomainError: Two bodies share a name, a body has no parts or sizes that nothing
            has, or a joint has no range.
    """

    bodies: tuple[Body, ...]
    hand: HandModel = QUICK
    floor_m: float = -0.425

    def __post_init__(self) -> None:
        names = [body.name for body in self.bodies]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise InvalidDomainError(f"a scene has two bodies named {', '.join(twice)}")
        for body in self.bodies:
            _require_buildable(body)

    @cached_property
    def free(self) -> tuple[Compound, ...]:
        """The rigid bodies that move."""
        return tuple(b for b in self.bodies if isinstance(b, Compound) and b.mass_kg > 0.0)

    @cached_property
    def jointed(self) -> tuple[JointedBody, ...]:
        """The bodies of which a part moves."""
        return tuple(b for b in self.bodies if isinstance(b, JointedBody))

    @cached_property
    def fixed(self) -> tuple[Compound, ...]:
        """The rigid bodies that do not move, the floor last."""
        fixed = (b for b in self.bodies if isinstance(b, Compound) and b.mass_kg == 0.0)
        depth = 0.5  # m
        top = Pose((0.0, 0.0, self.floor_m - depth))
        return (*fixed, box("floor", (FLOOR_HALF_M, FLOOR_HALF_M, depth), pose=top))


FLOOR_HALF_M = 40.0  # m; nothing rolls that far


def box(
    name: str,
    half_extents_m: Vector,
    *,
    mass_kg: float = 0.0,
    friction: float = THING_FRICTION,
    colour: Colour = GREY,
    pose: Pose = IDENTITY,
    solid: bool = True,
) -> Compound:
    """A body that is one cuboid; see :class:`Compound` and :class:`BoxPart`.

    Args:
        name: Name of the body.
        half_extents_m: Half the edges along the box's own axes, m.
        mass_kg: 0 for a body that never moves.
        friction: Coefficient of its surface.
        colour: Red, green, blue, alpha, each from 0 to 1.
        pose: Pose of a body without mass.
        solid: Whether others collide with it.
    """
    return Compound(
        name,
        (BoxPart(half_extents_m),),
        mass_kg=mass_kg,
        friction=friction,
        colour=colour,
        pose=pose,
        solid=solid,
    )


def cylinder(
    name: str,
    radius_m: float,
    length_m: float,
    *,
    mass_kg: float = 0.0,
    friction: float = THING_FRICTION,
    colour: Colour = GREY,
    pose: Pose = IDENTITY,
    solid: bool = True,
) -> Compound:
    """A body that is one cylinder about its own z; see :class:`Compound`.

    Args:
        name: Name of the body.
        radius_m: Radius of the cylinder, m.
        length_m: Length along the cylinder's own z, m.
        mass_kg: Mass, kg; 0 for a body that never moves.
        friction: Coefficient of friction of the surface.
        colour: Red, green, blue, alpha, each from 0 to 1.
        pose: Pose of a body without mass.
        solid: Whether others collide with it.
    """
    return Compound(
        name,
        (CylinderPart(radius_m, length_m),),
        mass_kg=mass_kg,
        friction=friction,
        colour=colour,
        pose=pose,
        solid=solid,
    )


# A table whose top is at the height of the arm's base.
TABLE = box(
    "table",
    (0.4, 0.5, 0.05),
    friction=TABLE_FRICTION,
    colour=WOOD,
    pose=Pose((0.55, 0.0, -0.05)),
)


def inertia(parts: Sequence[Part], mass_kg: float, about: Vector) -> Vector:
    """The diagonal of the inertia of parts that weigh by their volumes, kg m².

    Args:
        parts: Parts, all in one frame.
        mass_kg: Mass of all parts together, kg.
        about: Point of that frame through which the axes go, along those of the frame, m.
    """
    volume = sum(part.volume_m3 for part in parts)
    total = [0.0, 0.0, 0.0]
    for part in parts:
        mass = mass_kg * part.volume_m3 / volume
        own = part.inertia_per_kg
        x, y, z = (p - a for p, a in zip(part.pose.position, about, strict=True))
        steiner = (y * y + z * z, x * x + z * z, x * x + y * y)
        for i, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
            along = rotate(conjugate(part.pose.quaternion), axis)
            turned = sum(a * a * k for a, k in zip(along, own, strict=True))
            total[i] += mass * (turned + steiner[i])
    return (total[0], total[1], total[2])


def bounding_box(parts: Sequence[Part]) -> OrientedBox:
    """The box around parts of one frame, along the axes of that frame."""
    corners = [corner for part in parts for corner in part.bounding_box.corners()]
    low = [min(corner[i] for corner in corners) for i in range(3)]
    high = [max(corner[i] for corner in corners) for i in range(3)]
    x, y, z = ((a + b) / 2 for a, b in zip(low, high, strict=True))
    u, v, w = ((b - a) / 2 for a, b in zip(low, high, strict=True))
    return OrientedBox(Pose((x, y, z)), (u, v, w))


def _inner_boxes(parts: Sequence[Part], pose: Pose) -> tuple[OrientedBox, ...]:
    return tuple(part.inner_box.at(pose) for part in parts)


def _extent(part: OrientedBox, axis: Vector) -> float:
    """How far a box reaches along an axis from the origin of what it is a part of."""
    middle = sum(a * p for a, p in zip(axis, part.pose.position, strict=True))
    return middle + part.half_extent(axis)


def _require_buildable(body: Body) -> None:
    """Refuse what cannot be built, with the number that is wrong."""
    parts = body.parts if isinstance(body, Compound) else (*body.frame, *body.moving)
    groups = [parts] if isinstance(body, Compound) else [body.frame, body.moving]
    if not all(groups):
        raise InvalidDomainError(f"body {body.name} has a side without any parts")
    for part in parts:
        for size in part.bounding_box.half:
            if not 0.0 < size < math.inf:
                raise InvalidDomainError(
                    f"a part of {body.name} reaches {size} m from its middle, must be above 0"
                )
    jointed = isinstance(body, JointedBody)
    if not (0.0 < body.mass_kg < math.inf or (body.mass_kg == 0.0 and not jointed)):
        raise InvalidDomainError(f"the mass of {body.name} is {body.mass_kg} kg, not above 0")
    if not 0.0 <= body.friction < math.inf:
        raise InvalidDomainError(f"the friction of {body.name} is {body.friction}, below 0")
    if isinstance(body, Compound):
        if body.mass_kg > 0.0 and not body.solid:
            raise InvalidDomainError(f"free bodies must be solid, not so {body.name}")
        return
    joint = body.joint
    if not 0.0 < joint.high < math.inf:
        raise InvalidDomainError(f"{body.name} opens to {joint.high}, which must be above 0")
    if abs(math.hypot(*joint.axis) - 1.0) > 1e-6:
        raise InvalidDomainError(f"the axis of {body.name} is {joint.axis}, not of length 1")
    if joint.damping < 0.0 or joint.dry_friction < 0.0:
        raise InvalidDomainError(f"{body.name} has damping or dry friction below 0")
