# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a camera sees of a state, as data: the arm's joints, and shapes with their poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import ConvexPiece
from slap_ros.relational import State
from slap_ros.worlds.bodies import Colour


class Cylinder(NamedTuple):
    """A cylinder about its own z, with the origin in its middle."""

    radius_m: float
    length_m: float


class VisualShape(NamedTuple):
    """Something rigid to be drawn: a box by half its edges in m, a cylinder or a convex piece."""

    geometry: Vector | Cylinder | ConvexPiece
    colour: Colour


class Configuration(NamedTuple):
    """Where everything is that can be seen."""

    joints: Sequence[float]  # of the arm, rad
    fingers: tuple[float, float]  # m, distance of left and right from the middle
    poses: Sequence[Pose]  # of each shape, in the base's frame


class Visuals(Protocol):
    """What there is to be seen around a Panda: shapes that stay the same, in states that differ."""

    @property
    def shapes(self) -> Sequence[VisualShape]:
        """The shapes, in an order that does not change."""
        ...

    def configuration(self, state: State) -> Configuration:
        """The poses of the shapes in a state."""
        ...
