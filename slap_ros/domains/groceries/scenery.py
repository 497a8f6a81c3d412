# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: ten things of boxes and cylinders, and the basket; lengths in m, masses in kg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi

from slap_ros.domains.groceries.model import GROCERY
from slap_ros.geometry.pose import Pose, from_rotation_vector
from slap_ros.relational import State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import TABLE, BoxPart, Compound, ContactScene, CylinderPart, Part

LYING = from_rotation_vector((0.0, 0.5 * pi, 0.0))  # of a cylinder, along x


@dataclass(frozen=True)
class Grocery:
    """A thing as it stands, and where it is grasped: over its middle, the fingers along its y.

    Args:
        body: Body of the thing. The origin is its centre of mass.
        rest_height: Height of the thing's origin above what it stands on, m.
        half_width: Half the width of the part between the fingers, m.
        grasp_height: Height of the grasp point above the thing's origin, m.
    """

    body: Compound
    rest_height: float
    half_width: float
    grasp_height: float


def _grocery(
    name: str,
    parts: Sequence[Part],
    colour: Colour,
    *,
    mass_kg: float,
    half_width: float,
    grasp_at: float,
) -> Grocery:
    """A thing of parts that stand on z = 0, along the vertical through the origin.

    Args:
        name: Name of the thing's object.
        parts: Parts of the thing. Each has its share of the mass by its volume.
        colour: Colour of the parts that have none of their own.
        mass_kg: Mass of the whole thing, kg.
        half_width: Half the width of the part between the fingers, m.
        grasp_at: Height of the grasp point above what the thing stands on, m.
    """
    volume = sum(part.volume_m3 for part in parts)
    height = sum(part.volume_m3 * part.pose.position[2] for part in parts) / volume
    centred = tuple(replace(part, pose=_lowered(part.pose, height)) for part in parts)
    body = Compound(name, centred, mass_kg=mass_kg, colour=colour)
    return Grocery(body, height, half_width, grasp_at - height)


def _lowered(pose: Pose, by: float) -> Pose:
    x, y, z = pose.position
    return Pose((x, y, z - by), pose.quaternion)


def _standing_box(x: float, y: float, z: float, *, on: float = 0.0) -> BoxPart:
    """Half its edges, and the height on which it stands."""
    return BoxPart((x, y, z), Pose((0.0, 0.0, on + z)))


def _standing_cylinder(radius: float, length: float, *, on: float = 0.0) -> CylinderPart:
    return CylinderPart(radius, length, Pose((0.0, 0.0, on + 0.5 * length)))


GLASS: Colour = (0.20, 0.45, 0.25, 1.0)
TIN: Colour = (0.75, 0.25, 0.20, 1.0)
MILK: Colour = (0.90, 0.92, 0.96, 1.0)
CARDBOARD: Colour = (0.85, 0.65, 0.30, 1.0)
BUTTER: Colour = (0.95, 0.88, 0.50, 1.0)
JAM: Colour = (0.55, 0.12, 0.25, 1.0)
STEEL: Colour = (0.60, 0.65, 0.72, 1.0)
MEAT: Colour = (0.70, 0.35, 0.30, 1.0)
COCOA: Colour = (0.35, 0.20, 0.12, 1.0)
KETCHUP: Colour = (0.85, 0.10, 0.10, 1.0)
WICKER: Colour = (0.50, 0.36, 0.20, 1.0)

GROCERIES: Mapping[str, Grocery] = {
    thing.body.name: thing
    for thing in (
        _grocery(
            "bottle",
            (
                _standing_cylinder(0.028, 0.070),
                _standing_cylinder(0.020, 0.015, on=0.070),
                _standing_cylinder(0.013, 0.035, on=0.085),
            ),
            GLASS,
            mass_kg=0.2,
            half_width=0.013,
            grasp_at=0.104,
        ),
        _grocery(
            "can",
            (_standing_cylinder(0.030, 0.068),),
            TIN,
            mass_kg=0.2,
            half_width=0.030,
            grasp_at=0.046,
        ),
        _grocery(
            "milk",
            (_standing_box(0.024, 0.024, 0.040), _standing_box(0.024, 0.008, 0.008, on=0.080)),
            MILK,
            mass_kg=0.2,
            half_width=0.024,
            grasp_at=0.066,
        ),
        _grocery(
            "cereal",
            (_standing_box(0.036, 0.014, 0.050),),
            CARDBOARD,
            mass_kg=0.15,
            half_width=0.014,
            grasp_at=0.074,
        ),
        _grocery(
            "butter",
            (_standing_box(0.038, 0.020, 0.014),),
            BUTTER,
            mass_kg=0.15,
            half_width=0.020,
            grasp_at=0.014,
        ),
        _grocery(
            "jar",
            (_standing_cylinder(0.025, 0.045), _standing_cylinder(0.029, 0.020, on=0.045)),
            JAM,
            mass_kg=0.2,
            half_width=0.029,
            grasp_at=0.054,
        ),
        _grocery(
            "tuna",
            (_standing_cylinder(0.031, 0.030),),
            STEEL,
            mass_kg=0.15,
            half_width=0.031,
            grasp_at=0.015,
        ),
        _grocery(
            "sausage",
            (CylinderPart(0.016, 0.110, Pose((0.0, 0.0, 0.016), LYING)),),
            MEAT,
            mass_kg=0.12,
            half_width=0.016,
            grasp_at=0.014,
        ),
        _grocery(
            "chocolate",
            (_standing_box(0.045, 0.018, 0.008),),
            COCOA,
            mass_kg=0.1,
            half_width=0.018,
            grasp_at=0.0115,
        ),
        _grocery(
            "ketchup",
            (_standing_box(0.028, 0.017, 0.040), _standing_cylinder(0.012, 0.020, on=0.080)),
            KETCHUP,
            mass_kg=0.2,
            half_width=0.017,
            grasp_at=0.068,
        ),
    )
}

# The basket's frame is the middle of its floor, on which things stand. The floor is so thick that
# what stands on it is lifted (20 mm): it is held until it is let go, and never on the table.
INNER = 0.085  # half of what is between opposite walls
WALL = 0.0025  # half as thick as walls are
WALL_HEIGHT = 0.04  # above the floor
FLOOR_HEIGHT = 0.025  # above the table
OUTER = INNER + 2.0 * WALL
_MIDDLE = INNER + WALL
_WALLS = tuple(
    BoxPart(half, Pose((x, y, 0.5 * WALL_HEIGHT)))
    for half, x, y in (
        ((WALL, OUTER, 0.5 * WALL_HEIGHT), -_MIDDLE, 0.0),
        ((WALL, OUTER, 0.5 * WALL_HEIGHT), _MIDDLE, 0.0),
        ((INNER, WALL, 0.5 * WALL_HEIGHT), 0.0, -_MIDDLE),
        ((INNER, WALL, 0.5 * WALL_HEIGHT), 0.0, _MIDDLE),
    )
)
BASKET_BODY = Compound(
    "basket",
    (_standing_box(OUTER, OUTER, 0.5 * FLOOR_HEIGHT, on=-FLOOR_HEIGHT), *_WALLS),
    colour=WICKER,
)


@lru_cache(maxsize=256)
def scene_of_names(names: tuple[str, ...]) -> ContactScene:
    """The table, the basket and the things of these names."""
    return ContactScene((TABLE, BASKET_BODY, *(GROCERIES[name].body for name in names)))


def scene_of(state: State) -> ContactScene:
    """The bodies of a state."""
    return scene_of_names(tuple(obj.name for obj in state.layout.of_type(GROCERY)))
