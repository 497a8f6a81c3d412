# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make the shapes beside this file: ``python -m slap_ros.domains.cleanup_table.shapes.make``.

Each is a few stacks of rings. x is to the front, z up, the floor at 0; lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from slap_ros.geometry.pose import Vector
from slap_ros.meshes.obj import to_obj
from slap_ros.meshes.solid import ConvexPiece

SIDES = 8  # of a ring
DIGITS = 5  # of a coordinate: hundredths of a millimetre


class Ring(NamedTuple):
    """An ellipse that lies flat."""

    z: float
    x: float  # of its middle
    along: float  # half its axis along x
    across: float  # half its axis along y
    y: float = 0.0  # of its middle


def stack(rings: Sequence[Ring], sides: int = SIDES) -> ConvexPiece:
    """The hull of rings from the bottom upwards. Convex where their sizes bulge, which is trusted.

    With four sides they are rectangles whose half edges are ``along`` and ``across``.
    """
    if sides == 4:
        corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
    else:
        angles = [2.0 * math.pi * (k + 0.5) / sides for k in range(sides)]
        corners = [(math.cos(angle), math.sin(angle)) for angle in angles]
    vertices: list[Vector] = [
        (
            round(ring.x + ring.along * c, DIGITS),
            round(ring.y + ring.across * s, DIGITS),
            round(ring.z, DIGITS),
        )
        for ring in rings
        for c, s in corners
    ]
    last = (len(rings) - 1) * sides
    triangles = [(0, k + 1, k) for k in range(1, sides - 1)]
    triangles += [(last, last + k, last + k + 1) for k in range(1, sides - 1)]
    for floor in range(0, last, sides):
        for k in range(sides):
            a, b = floor + k, floor + (k + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return ConvexPiece(tuple(vertices), tuple(triangles))


def block(low: Vector, high: Vector) -> ConvexPiece:
    """A cuboid between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    middle = ((x0 + x1) / 2, (x1 - x0) / 2, (y1 - y0) / 2, (y0 + y1) / 2)
    return stack([Ring(z0, *middle), Ring(z1, *middle)], sides=4)


def duck() -> list[ConvexPiece]:
    """8 cm long, sitting."""
    body = [
        Ring(0.0, 0.0, 0.028, 0.016),
        Ring(0.008, 0.0, 0.036, 0.022),
        Ring(0.02, -0.002, 0.038, 0.024),
        Ring(0.032, -0.004, 0.030, 0.018),
    ]
    head = [
        Ring(0.026, 0.022, 0.010, 0.010),
        Ring(0.036, 0.023, 0.016, 0.015),
        Ring(0.046, 0.023, 0.016, 0.015),
        Ring(0.056, 0.022, 0.009, 0.009),
    ]
    beak = [Ring(0.036, 0.040, 0.006, 0.006), Ring(0.042, 0.038, 0.006, 0.008)]
    tail = [Ring(0.018, -0.030, 0.008, 0.010), Ring(0.038, -0.036, 0.006, 0.008)]
    return [stack(body), stack(head), stack(beak, sides=4), stack(tail, sides=4)]


def toy_robot() -> list[ConvexPiece]:
    """6 cm high, arms at its sides."""
    pieces = [
        block((-0.014, -0.018, 0.016), (0.014, 0.018, 0.042)),  # trunk
        block((-0.011, -0.012, 0.042), (0.011, 0.012, 0.060)),  # head
    ]
    for side in (-1.0, 1.0):
        inner, outer = sorted((side * 0.003, side * 0.018))
        pieces.append(block((-0.014, inner, 0.0), (0.020, outer, 0.016)))  # leg and foot
        inner, outer = sorted((side * 0.018, side * 0.030))
        pieces.append(block((-0.008, inner, 0.018), (0.012, outer, 0.038)))  # arm
    return pieces


def dinosaur() -> list[ConvexPiece]:
    """9 cm from nose to tail, on two broad feet."""
    body = [
        Ring(0.010, 0.0, 0.020, 0.014),
        Ring(0.020, 0.0, 0.028, 0.018),
        Ring(0.032, 0.002, 0.024, 0.015),
        Ring(0.040, 0.006, 0.012, 0.009),
    ]
    neck = [Ring(0.030, 0.014, 0.010, 0.009), Ring(0.050, 0.026, 0.009, 0.008)]
    head = [Ring(0.044, 0.032, 0.013, 0.009), Ring(0.056, 0.030, 0.010, 0.008)]
    tail = [Ring(0.0, -0.038, 0.008, 0.006), Ring(0.022, -0.022, 0.010, 0.010)]
    pieces = [stack(body), stack(neck), stack(head), stack(tail)]
    for side in (-1.0, 1.0):
        leg = [Ring(0.0, 0.006, 0.016, 0.008, side * 0.012)]
        leg += [Ring(0.016, 0.002, 0.012, 0.007, side * 0.012)]
        pieces.append(stack(leg, sides=4))
    return pieces


def wiper() -> list[ConvexPiece]:
    """A blade of 26 cm across, with a handle to take it by."""
    return [
        block((-0.130, -0.008, 0.0), (0.130, 0.008, 0.032)),
        block((-0.014, -0.010, 0.030), (0.014, 0.010, 0.054)),
    ]


SHAPES: Mapping[str, list[ConvexPiece]] = {
    "duck": duck(),
    "toy_robot": toy_robot(),
    "dinosaur": dinosaur(),
    "wiper": wiper(),
}


def main() -> None:
    """Write every shape to a file beside this one."""
    for name, pieces in SHAPES.items():
        Path(__file__).with_name(f"{name}.obj").write_text(to_obj(pieces), encoding="utf-8")


if __name__ == "__main__":
    main()
