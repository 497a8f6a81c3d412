# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make Coffee: a pod, a cabinet for pods, and a holder for one pod under a lid. Lengths in m.

The holder's frame lies on the table in the middle of the holder; the lid's hinge is towards x of
it. An open lid leans back, away from the holder. A pod's axis is its own z.
"""

from __future__ import annotations

import math
from functools import lru_cache

from slap_ros.domains.benchtop.cabinet import CABINET, CabinetShape
from slap_ros.domains.benchtop.features import LID, THING
from slap_ros.geometry.pose import Pose, Vector, from_rotation_vector, from_yaw
from slap_ros.relational import Layout, State, Type
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import (
    TABLE,
    BoxPart,
    Compound,
    ContactScene,
    Joint,
    JointedBody,
    JointKind,
    cylinder,
)

POD = Type("pod", THING.features, THING)
HOLDER = Type("holder", LID.features, LID)

POD_RADIUS, POD_HALF = 0.025, 0.025
POD_MASS, POD_FRICTION = 0.06, 0.5  # kg, 1
HOLDER_RADIUS = 0.029  # of the circle inside its walls
SIDES, WALL = 8, 0.004  # of the holder; half the thickness of a wall
BOTTOM, RIM = 0.01, 0.024  # heights over the table
HINGE: Vector = (0.075, 0.0, 0.072)
LID_LENGTH, LID_HALF_WIDTH, LID_THICK = 0.11, 0.06, 0.004  # the last is a half
LID_HIGH = 2.1  # rad
# So rough that a pod which hangs on a wall is not pushed in by chance: with friction 0.5, a random
# policy inserted one of ten pods.
HOLDER_FRICTION = 2.0  # 1
LID_MASS = 0.05  # kg
STAYS = 0.05  # N m, of the hinge's dry friction: the lid stays where it is left

# A pod stands upright in the front part of the drawer, under a roof that is high enough for it.
# Open fingers reach 54 mm to either side of it, and must come down between the walls.
SHAPE = CabinetShape(half_width=0.085, headroom=2.0 * POD_HALF + 0.004, compartment=0.115)
BROWN: Colour = (0.45, 0.3, 0.2, 1.0)
WHITE: Colour = (0.92, 0.92, 0.9, 1.0)
RED: Colour = (0.75, 0.2, 0.2, 1.0)


def pod(name: str) -> Compound:
    """A pod: a cylinder that stands upright."""
    return cylinder(
        name, POD_RADIUS, 2.0 * POD_HALF, mass_kg=POD_MASS, friction=POD_FRICTION, colour=BROWN
    )


def holder(name: str) -> JointedBody:
    """A holder for one pod, under a lid that turns."""
    half = 0.5 * LID_LENGTH
    joint = Joint(
        JointKind.TURN,
        (0.0, 1.0, 0.0),
        LID_HIGH,
        mount=Pose(HINGE),
        damping=0.02,
        dry_friction=STAYS,
    )
    lid = BoxPart((half, LID_HALF_WIDTH, LID_THICK), Pose((-half, 0.0, 0.0)))
    return JointedBody(
        name,
        (*_base(), *_walls()),
        (lid,),
        joint,
        LID_MASS,
        friction=HOLDER_FRICTION,
        moving_colour=RED,
    )


def _base() -> tuple[BoxPart, ...]:
    """A plate, and the post that carries the hinge."""
    x, _, z = HINGE
    post = 0.5 * (z - LID_THICK - 0.002)
    return (
        BoxPart((0.065, 0.045, 0.5 * BOTTOM), Pose((0.02, 0.0, 0.5 * BOTTOM)), WHITE),
        BoxPart((0.006, 0.04, post), Pose((x, 0.0, post)), WHITE),
    )


def _walls() -> list[BoxPart]:
    """Walls around what a pod goes into."""
    high, away = 0.5 * (RIM - BOTTOM), HOLDER_RADIUS + WALL
    along = (away + WALL) * math.tan(math.pi / SIDES)
    walls = []
    for turn in (from_yaw(2.0 * math.pi * k / SIDES) for k in range(SIDES)):
        at = Pose(quaternion=turn).apply((away, 0.0, BOTTOM + high))
        walls.append(BoxPart((WALL, along, high), Pose(at, turn)))
    return walls


def lid_pose(frame: Pose, opening: float) -> Pose:
    """The lid's frame: its origin in the hinge, x away from its edge, z up while it is closed.

    Args:
        frame: Pose of the holder in the base's frame.
        opening: How far the lid is open, rad.
    """
    turn = from_rotation_vector((0.0, opening, 0.0))
    return frame.compose(Pose(HINGE, turn))


def scene_of(state: State) -> ContactScene:
    """The bodies of a state."""
    return _scene_of(state.layout)


@lru_cache(maxsize=64)
def _scene_of(layout: Layout) -> ContactScene:
    pods = [pod(obj.name) for obj in layout.of_type(POD)]
    cabinets = [SHAPE.body(obj.name, BROWN) for obj in layout.of_type(CABINET)]
    holders = [holder(obj.name) for obj in layout.of_type(HOLDER)]
    return ContactScene((TABLE, *pods, *cabinets, *holders))
