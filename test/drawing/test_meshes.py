# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Triangles are drawn as the faces that they make."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slap_ros.core import VisibleBody
from slap_ros.domains.benchtop.visualization import SIDES, prism_triangles
from slap_ros.drawing.meshes import MOST_TRIANGLES, body_paths
from slap_ros.drawing.projection import OBLIQUE, SIDE, TOP, Canvas, box_paths, box_triangles
from slap_ros.geometry.pose import from_rotation_vector

BOX = VisibleBody(
    "box",
    (0.3, 0.1, 0.2),
    from_rotation_vector((0.4, -0.2, 1.0)),
    (0.1, 0.2, 0.3),
    (1.0, 0.0, 0.0, 1.0),
)
CANVAS = Canvas(-1.0, 1.0, 2.0, 2.0)
PRISM = replace(BOX, triangles=prism_triangles(0.05, 0.2))


def outwards(body: VisibleBody) -> VisibleBody:
    """A box as triangles that are anticlockwise seen from outside, in its own frame."""
    still = replace(body, position=(0.0, 0.0, 0.0), quaternion=(0.0, 0.0, 0.0, 1.0))
    corners = []
    for a, b, c in box_triangles(still):
        u, v = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        out = sum(n * p for n, p in zip(normal, a, strict=True)) > 0.0
        corners += [a, b, c] if out else [a, c, b]
    return replace(body, triangles=tuple(corners))


def faces(path: str) -> list[list[tuple[int, int]]]:
    """The corners of every closed line of a path."""
    numbers = [list(map(int, line[:-1].split(" "))) for line in path.split("M")[1:]]
    return [list(zip(line[::2], line[1::2], strict=True)) for line in numbers]


@pytest.mark.parametrize("view", [OBLIQUE, SIDE, TOP], ids=lambda view: view.name)
def test_the_triangles_of_a_box_are_drawn_as_the_box(view):
    for drawn, expected in zip(
        body_paths(outwards(BOX), view, CANVAS), box_paths(BOX, view, CANVAS), strict=True
    ):
        assert set(map(frozenset, faces(drawn))) == set(map(frozenset, faces(expected)))


def test_a_cylinder_has_a_side_and_two_ends():
    upright = replace(PRISM, quaternion=(0.0, 0.0, 0.0, 1.0))
    seen, _, _ = body_paths(upright, OBLIQUE, CANVAS)
    assert len(faces(seen)) == 2  # the side and the upper end
    (circle,) = faces(body_paths(upright, TOP, CANVAS)[0])
    assert len(circle) == SIDES
    (side,) = faces(body_paths(upright, SIDE, CANVAS)[0])
    assert len(side) >= SIDES  # half of the rim, above and below


def test_what_has_too_many_triangles_is_drawn_as_a_box():
    many = replace(BOX, triangles=PRISM.triangles * MOST_TRIANGLES)
    assert body_paths(many, OBLIQUE, CANVAS) == box_paths(BOX, OBLIQUE, CANVAS)
