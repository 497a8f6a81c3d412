# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: pegs that lie on a table, and upright plates with a hole each. Lengths in m.

The axis of a peg and of a hole is its own x. A hole's x points into it, its z up. A hole's origin
is its *seat*: where the middle of a peg is whose tip is at the far side of the plate.
"""

from __future__ import annotations

from functools import lru_cache

from slap_ros.geometry.pose import ORIGIN, Pose, Vector, from_rotation_vector, from_yaw, rotate
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import TABLE, BoxPart, Compound, ContactScene, CylinderPart

RED: Colour = (0.85, 0.25, 0.2, 1.0)
BLUE: Colour = (0.3, 0.45, 0.75, 1.0)
STEEL: Colour = (0.7, 0.72, 0.75, 1.0)

PEG_RADIUS, PEG_LENGTH = 0.012, 0.15
PEG_MASS_KG = 0.15
DEPTH = 0.06  # of a hole, from the plate's face to its far side
FACE = 0.5 * PEG_LENGTH - DEPTH  # from the seat to the plate's face, along the hole's axis
WALL = 0.008  # above a hole and beside it; what is higher would be in the palm's way
FOOT = 0.2  # from the hole's axis down: plates reach into the table, whatever the hole's height
PLATE_FRICTION = 0.5  # 1

PEGS = {"peg1": RED, "peg2": BLUE}
HOLES = ("hole1", "hole2")
_ALONG_X = Pose(ORIGIN, from_rotation_vector((0.0, 1.5707963267948966, 0.0)))


def peg(name: str, colour: Colour) -> Compound:
    """A round rod."""
    rod = CylinderPart(PEG_RADIUS, PEG_LENGTH, _ALONG_X)
    return Compound(name, (rod,), mass_kg=PEG_MASS_KG, colour=colour)


def plate(name: str, clearance: float) -> Compound:
    """A plate with a square hole.

    Args:
        name: Name of the hole's object.
        clearance: Difference between the width of the hole and the diameter of a peg, m.
    """
    half, deep, middle = PEG_RADIUS + 0.5 * clearance, 0.5 * DEPTH, FACE + 0.5 * DEPTH
    wall, foot = 0.5 * WALL, 0.5 * (FOOT - half)
    wide = half + WALL
    parts = (
        BoxPart((deep, wide, wall), Pose((middle, 0.0, half + wall))),
        BoxPart((deep, wall, half), Pose((middle, half + wall, 0.0))),
        BoxPart((deep, wall, half), Pose((middle, -half - wall, 0.0))),
        BoxPart((deep, wide, foot), Pose((middle, 0.0, -half - foot))),
    )
    return Compound(name, parts, friction=PLATE_FRICTION, colour=STEEL)


def wall_top(clearance: float) -> float:
    """The height from a hole's axis up to the top of its plate, m.

    Args:
        clearance: Difference between the width of the hole and the diameter of a peg, m.
    """
    return PEG_RADIUS + 0.5 * clearance + WALL


def seat(mouth: Vector, yaw: float) -> Pose:
    """A hole's pose.

    Args:
        mouth: Position at which the hole's axis leaves the plate's face, m.
        yaw: Turn of the plate about the vertical, rad; at 0 the hole leads along x.
    """
    back, aside, _ = rotate(from_yaw(yaw), (-FACE, 0.0, 0.0))
    x, y, z = mouth
    return Pose((x + back, y + aside, z), from_yaw(yaw))


@lru_cache(maxsize=16)
def scene(clearance: float) -> ContactScene:
    """Table, pegs and plates with holes.

    Args:
        clearance: Difference between the width of the holes and the diameter of a peg, m.
    """
    pegs = [peg(name, colour) for name, colour in PEGS.items()]
    return ContactScene((TABLE, *pegs, *(plate(name, clearance) for name in HOLES)))
