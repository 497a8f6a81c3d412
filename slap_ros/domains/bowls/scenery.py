# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: the bowl, the plate, and what stands around them. Lengths in m, masses in kg."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from slap_ros.domains.benchtop.features import place_features, thing_features
from slap_ros.domains.bowls.model import BOWL, HALVES
from slap_ros.geometry.pose import Pose, Vector, from_yaw, rotate
from slap_ros.relational import Layout, State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import TABLE, BoxPart, Compound, ContactScene, CylinderPart, Part

BLACK: Colour = (0.15, 0.15, 0.17, 1.0)
CHINA: Colour = (0.92, 0.92, 0.88, 1.0)
CLAY: Colour = (0.72, 0.42, 0.28, 1.0)
CARDBOARD: Colour = (0.90, 0.75, 0.35, 1.0)
IRON: Colour = (0.30, 0.30, 0.33, 1.0)
BAMBOO: Colour = (0.70, 0.62, 0.40, 1.0)
OAK: Colour = (0.55, 0.38, 0.22, 1.0)


# -- the bowl -------------------------------------------------------------------------------------

SIDES = 8  # walls
WALL = 0.003  # half as thick as walls and bottom are
RIM_RADIUS = 0.0395  # from the middle to the middle of a wall; too wide to be grasped across
OUTSIDE = (RIM_RADIUS + WALL) / math.cos(math.pi / SIDES)  # from the middle to a corner
BOWL_HEIGHT = 0.045
BOWL_MASS = 0.15
GRASPED_BELOW = 0.006  # the upper edge of the rim


def _wall(number: int) -> BoxPart:
    turn = from_yaw(2.0 * math.pi * number / SIDES)
    half = (RIM_RADIUS + WALL) * math.tan(math.pi / SIDES)
    at = rotate(turn, (0.0, RIM_RADIUS, 0.5 * BOWL_HEIGHT))
    return BoxPart((half, WALL, 0.5 * BOWL_HEIGHT), Pose(at, turn))


def _bottom(number: int) -> BoxPart:
    """A strip from one wall to the opposite one; four of them fill an octagon."""
    turn = from_yaw(2.0 * math.pi * number / SIDES)
    half = (RIM_RADIUS + WALL) * math.tan(math.pi / SIDES)
    return BoxPart((half, RIM_RADIUS + WALL, WALL), Pose((0.0, 0.0, WALL), turn))


_STANDING: tuple[BoxPart, ...] = (
    *(_wall(number) for number in range(SIDES)),
    *(_bottom(number) for number in range(SIDES // 2)),
)
REST_HEIGHT = sum(part.volume_m3 * part.pose.position[2] for part in _STANDING) / sum(
    part.volume_m3 for part in _STANDING
)  # of the centre of mass
RIM_HEIGHT = BOWL_HEIGHT - GRASPED_BELOW - REST_HEIGHT  # over the centre of mass
# Where the hand grasps a bowl, seen from it: at the wall on its left. The fingers are along y.
GRIP: Vector = (0.0, RIM_RADIUS, RIM_HEIGHT)


def bowl(name: str) -> Compound:
    """A bowl with eight sides."""
    return Compound(name, _lowered(_STANDING, REST_HEIGHT), mass_kg=BOWL_MASS, colour=BLACK)


def bowl_features(pose: Pose) -> Mapping[str, float]:
    """The features of a bowl at rest, for ``State.build``."""
    sizes = {"rim_radius": RIM_RADIUS, "rim_height": RIM_HEIGHT}
    return {**thing_features(pose, REST_HEIGHT, BOWL_HEIGHT - REST_HEIGHT), **sizes}


# -- what stands still ----------------------------------------------------------------------------


def _lowered(parts: Sequence[Part], by: float) -> tuple[Part, ...]:
    return tuple(
        replace(part, pose=Pose((x, y, z - by), part.pose.quaternion))
        for part in parts
        for x, y, z in [part.pose.position]
    )


@dataclass(frozen=True)
class Furniture:
    """What a bowl can stand on, with the middle of where it stands for its frame.

    Args:
        body: Body of the furniture; it is fixed.
        height: Height of the furniture's frame over the table, m.
        half_length: Half the length, along x, of the area that bowls can stand on, m.
        half_width: Half the width, along y, of the area that bowls can stand on, m.
    """

    body: Compound
    height: float
    half_length: float
    half_width: float

    def features(self, pose: Pose) -> Mapping[str, float]:
        """The furniture's features, for ``State.build``; the pose is that of its frame."""
        halves = dict(zip(HALVES, (self.half_length, self.half_width), strict=True))
        return {**place_features(pose), **halves}


def _block(
    name: str, half_length: float, half_width: float, height: float, colour: Colour
) -> Furniture:
    half = (half_length, half_width, 0.5 * height)
    part = BoxPart(half, Pose((0.0, 0.0, -0.5 * height)))
    return Furniture(Compound(name, (part,), colour=colour), height, half_length, half_width)


def _ramekin() -> Furniture:
    radius, height = 0.04, 0.035
    part = CylinderPart(radius, height, Pose((0.0, 0.0, -0.5 * height)))
    return Furniture(Compound("ramekin", (part,), colour=CLAY), height, radius, radius)


def _tray() -> Furniture:
    """A tray with walls that are lower than fingers that grasp a bowl in it."""
    half, wall, floor, high = 0.08, 0.003, 0.006, 0.012
    parts = (
        BoxPart((half, half, 0.5 * floor), Pose((0.0, 0.0, -0.5 * floor))),
        *(
            BoxPart((wall, half, 0.5 * high), Pose((side * (half - wall), 0.0, 0.5 * high)))
            for side in (-1.0, 1.0)
        ),
        *(
            BoxPart((half, wall, 0.5 * high), Pose((0.0, side * (half - wall), 0.5 * high)))
            for side in (-1.0, 1.0)
        ),
    )
    return Furniture(Compound("tray", parts, colour=BAMBOO), floor, half, half)


FURNITURE: Mapping[str, Furniture] = {
    piece.body.name: piece
    for piece in (
        _ramekin(),
        _block("cookies", 0.07, 0.055, 0.04, CARDBOARD),
        _tray(),
        _block("stove", 0.075, 0.075, 0.025, IRON),
        _block("cabinet", 0.06, 0.06, 0.12, OAK),
    )
}

# The plate has a foot: what stands on it is lifted, so that a bowl is held until it is let go.
PLATE_RADIUS, PLATE_HEIGHT, _RIM = 0.075, 0.026, 0.008
PLATE_BODY = Compound(
    "plate",
    (
        CylinderPart(PLATE_RADIUS, _RIM, Pose((0.0, 0.0, -0.5 * _RIM))),
        CylinderPart(0.04, PLATE_HEIGHT - _RIM, Pose((0.0, 0.0, -0.5 * (PLATE_HEIGHT + _RIM)))),
    ),
    colour=CHINA,
)


def scene_of(state: State) -> ContactScene:
    """The bodies of a state."""
    return _scene(state.layout)


@lru_cache(maxsize=256)
def _scene(layout: Layout) -> ContactScene:
    pieces = (FURNITURE[name].body for name in FURNITURE if name in layout.by_name)
    bowls = (bowl(obj.name) for obj in layout.of_type(BOWL))
    return ContactScene((TABLE, PLATE_BODY, *pieces, *bowls))
