# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What physics is told of convex pieces, against what is known of bodies; and their files."""

import math

import numpy as np
import pytest

from slap_ros.domains.cleanup_table.shapes import make, shipped
from slap_ros.domains.cleanup_table.shapes.make import Ring, block, stack
from slap_ros.errors import InvalidMeshError
from slap_ros.meshes.obj import from_obj, to_obj
from slap_ros.meshes.solid import ConvexPiece, Solid

BRICK = block((1.0, 2.0, 3.0), (1.2, 2.4, 3.6))  # m


def test_a_brick_turns_about_its_middle_as_bricks_do():
    solid = Solid.of([BRICK])
    assert solid.points.min(0) == pytest.approx([-0.1, -0.2, -0.3])
    assert solid.points.max(0) == pytest.approx([0.1, 0.2, 0.3])
    x, y, z = 0.2, 0.4, 0.6
    assert solid.inertia == pytest.approx(
        [(y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12]
    )
    assert solid.radius == pytest.approx(math.hypot(0.1, 0.2, 0.3))
    assert solid.extent((0.0, 0.6, 0.8)) == pytest.approx(0.6 * 0.2 + 0.8 * 0.3)


def test_a_brick_in_two_halves_is_the_same_brick():
    halves = [block((0.0, 0.0, 0.0), (0.1, 0.4, 0.6)), block((0.1, 0.0, 0.0), (0.2, 0.4, 0.6))]
    whole, parted = Solid.of([BRICK]), Solid.of(halves)
    assert parted.inertia == pytest.approx(whole.inertia)
    assert parted.bounds.half == pytest.approx(whole.bounds.half)
    assert parted != whole


def test_a_round_body_has_the_moments_of_a_sphere():
    levels = np.linspace(-0.999, 0.999, 41)
    rings = [Ring(z, 0.0, math.sqrt(1 - z * z), math.sqrt(1 - z * z)) for z in levels]
    solid = Solid.of([stack(rings, sides=64)])
    assert solid.inertia == pytest.approx([0.4] * 3, rel=0.01)  # 2/5 m r²


@pytest.mark.parametrize("name", make.SHAPES)
def test_cores_are_inside_their_pieces(name):
    solid = shipped()[name]
    for core, piece in zip(solid.cores, solid.pieces, strict=True):
        corners = np.array(piece.vertices)[np.array(piece.triangles)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for corner in core.corners():
            assert (((np.array(corner) - corners[:, 0]) * normals).sum(1) <= 1e-12).all()
        assert min(core.half) > 1e-3


@pytest.mark.parametrize("name", make.SHAPES)
def test_the_shapes_that_are_shipped_are_those_of_the_script(name):
    made, solid = Solid.of(make.SHAPES[name]), shipped()[name]
    assert solid == made
    assert hash(solid) == hash(made)
    if name != "wiper":
        assert 0.06 <= 2 * max(solid.bounds.half) <= 0.09  # m, as in the reference


def test_pieces_are_read_as_they_were_written():
    pieces = [piece for solid in shipped().values() for piece in solid.pieces]
    assert from_obj(to_obj(pieces)) == pieces


def test_nothing_inside_out_flat_or_endless_is_a_solid():
    inside_out = ConvexPiece(BRICK.vertices, tuple((a, c, b) for a, b, c in BRICK.triangles))
    flat = block((0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    endless = ConvexPiece(((math.inf, 0.0, 0.0), *BRICK.vertices[1:]), BRICK.triangles)
    for pieces in ([], [inside_out], [BRICK, flat], [endless]):
        with pytest.raises(InvalidMeshError):
            Solid.of(pieces)


@pytest.mark.parametrize(
    "text", ["v 0 0 0", "o a\nv 0 0", "o a\nv 0 0 0\nf 1 2 3", "o a\nv 0 0 x", "o a\nf 1 2"]
)
def test_a_file_that_is_not_ours_is_refused_with_its_line(text):
    with pytest.raises(InvalidMeshError, match=f"line {len(text.splitlines())}"):
        from_obj(text)
