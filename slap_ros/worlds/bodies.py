# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What rigid bodies of all worlds have in common: mass, friction, colour and place."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self

from slap_ros.geometry.pose import IDENTITY, Pose

Colour = tuple[float, float, float, float]  # red green blue opacity, 0 to 1

GREY: Colour = (0.6, 0.6, 0.6, 1.0)
WOOD: Colour = (0.72, 0.6, 0.47, 1.0)


class Material(NamedTuple):
    """What a body is made of, as far as dynamics is concerned."""

    mass_kg: float  # of the whole body
    friction: float  # Coulomb's coefficient; that of a pair of bodies is the product of both


@dataclass(frozen=True)
class RigidBody:
    """What bodies of all shapes have in common.

    Args:
        name: Name of the body, which is that of its object in the state.
        mass_kg: Mass, kg; 0 for a body that is fixed. A free body may have another mass in the
            state.
        friction: Coefficient of friction, see :class:`Material`; a free body may have another one
            in the state.
        colour: Colour in pictures.
        pose: Pose of a fixed body, unless the state has pose features for it. The pose of a free
            body is always in the state.
        solid: Whether others collide with the body; False for one that only marks a place.
    """

    name: str
    mass_kg: float = field(default=0.0, kw_only=True)
    friction: float = field(kw_only=True)
    colour: Colour = field(default=GREY, kw_only=True)
    pose: Pose = field(default=IDENTITY, kw_only=True)
    solid: bool = field(default=True, kw_only=True)

    @property
    def material(self) -> Material:
        """The body's material, unless the state has another."""
        return Material(self.mass_kg, self.friction)

    def with_material(self, material: Material) -> Self:
        """The same body with another material."""
        return replace(self, mass_kg=material.mass_kg, friction=material.friction)
