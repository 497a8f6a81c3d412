# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stow Hammer: the bodies. Lengths in m."""

from __future__ import annotations

import math
from functools import lru_cache

from slap_ros.domains.benchtop.cabinet import CABINET, CabinetShape
from slap_ros.domains.benchtop.features import THING
from slap_ros.geometry.pose import Pose, from_rotation_vector
from slap_ros.relational import Layout, State, Type
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import TABLE, BoxPart, Compound, ContactScene, CylinderPart

HAMMER = Type("hammer", THING.features, THING)

RADIUS, HANDLE_LENGTH = 0.012, 0.15  # of the handle, which is along x
HEAD_HALF = (0.012, 0.03, 0.012)
HALF_LENGTH = 0.5 * HANDLE_LENGTH + HEAD_HALF[0]
HAMMER_MASS = 0.2  # kg
SHAPE = CabinetShape(half_width=HALF_LENGTH + 0.01, headroom=0.03)
COLOURS: tuple[Colour, ...] = (
    (0.85, 0.25, 0.2, 1.0),
    (0.3, 0.45, 0.75, 1.0),
    (0.35, 0.65, 0.35, 1.0),
    (0.85, 0.7, 0.25, 1.0),
)
_ALONG_X = from_rotation_vector((0.0, 0.5 * math.pi, 0.0))


def hammer(name: str, colour: Colour) -> Compound:
    """A hammer with so heavy a handle that it balances on its middle, which is its origin."""
    handle, head = HEAD_HALF[0], 0.5 * HANDLE_LENGTH
    parts = (
        CylinderPart(RADIUS, HANDLE_LENGTH, Pose((-handle, 0.0, 0.0), _ALONG_X)),
        BoxPart(HEAD_HALF, Pose((head, 0.0, 0.0))),
    )
    return Compound(name, parts, mass_kg=HAMMER_MASS, colour=colour)


def scene_of(state: State) -> ContactScene:
    """The bodies of a state."""
    return _scene_of(state.layout)


@lru_cache(maxsize=64)
def _scene_of(layout: Layout) -> ContactScene:
    """Hammers and cabinets of one number have one colour."""
    hammers = [hammer(obj.name, _colour(i)) for i, obj in enumerate(layout.of_type(HAMMER))]
    cabinets = [SHAPE.body(obj.name, _colour(i)) for i, obj in enumerate(layout.of_type(CABINET))]
    return ContactScene((TABLE, *hammers, *cabinets))


def _colour(number: int) -> Colour:
    return COLOURS[number % len(COLOURS)]
