# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid shapes made of convex pieces, and what physics wants to know of them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidMeshError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.determinants import determinants

Array = NDArray[np.float64]
Moments = tuple[float, Array, Array]  # see _moments
FLAT = 1e-3  # m, by which points of a face may be off its plane
LEAST_VOLUME = 1e-12  # m³: a cube of a tenth of a millimetre


class ConvexPiece(NamedTuple):
    """A convex polyhedron."""

    vertices: tuple[Vector, ...]  # m
    triangles: tuple[tuple[int, int, int], ...]  # indices of vertices, anticlockwise from outside


# Of a box whose corners come in the order of their coordinates, z the fastest.
_FACES = (
    *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)),
    *((0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)),
    *((0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
)


def cuboid(half: Vector) -> ConvexPiece:
    """A box with the given half edges, m."""
    x, y, z = half
    corners = product((-x, x), (-y, y), (-z, z))
    return ConvexPiece(tuple(corners), _FACES)


def prism(radius_m: float, length_m: float, sides: int) -> ConvexPiece:
    """A prism about z in place of a cylinder, with the origin in its middle.

    Args:
        radius_m: Radius of the circle that the corners are on, m.
        length_m: Length from end to end, m.
        sides: Number of sides, three or more.

    Returns:
        The prism; its corners at the lower end come before those at the upper end.
    """
    angles = [2.0 * math.pi * k / sides for k in range(sides)]
    rim = [(radius_m * math.cos(angle), radius_m * math.sin(angle)) for angle in angles]
    vertices = tuple((x, y, sign * 0.5 * length_m) for sign in (-1.0, 1.0) for x, y in rim)
    triangles: list[tuple[int, int, int]] = []
    for k in range(sides):
        after = (k + 1) % sides
        triangles += [(k, after, sides + after), (k, sides + after, sides + k)]
    for k in range(1, sides - 1):
        triangles += [(0, k + 1, k), (sides, sides + k, sides + k + 1)]
    return ConvexPiece(vertices, tuple(triangles))


@dataclass(frozen=True, eq=False)
class Solid:
    """Convex pieces that move as one, of the same density; the origin is their centre of mass.

    Where pieces overlap, what they share counts twice.
    """

    pieces: tuple[ConvexPiece, ...]

    @staticmethod
    def of(pieces: Sequence[ConvexPiece]) -> Solid:
        """The solid of pieces that are seen from anywhere.

        Raises:
            InvalidMeshError: There is no piece, or one encloses nothing, as one does whose
                triangles are turned inside out.
        """
        if not pieces:
            raise InvalidMeshError("a solid needs at least one piece")
        moments = []
        for number, piece in enumerate(pieces, start=1):
            if not np.isfinite(piece.vertices).all():
                raise InvalidMeshError(f"piece {number} has vertices that are not finite")
            if not piece.triangles or (found := _moments(piece))[0] < LEAST_VOLUME:
                raise InvalidMeshError(
                    f"piece {number} encloses no volume; are its triangles anticlockwise, seen "
                    "from outside, and its lengths in metres?"
                )
            moments.append(found)
        cx, cy, cz = (np.sum([m[1] for m in moments], 0) / sum(m[0] for m in moments)).tolist()
        return Solid(
            tuple(
                ConvexPiece(tuple((x - cx, y - cy, z - cz) for x, y, z in vertices), triangles)
                for vertices, triangles in pieces
            )
        )

    @cached_property
    def points(self) -> Array:
        """The vertices of all pieces, m, shape (n, 3)."""
        return np.concatenate([np.array(piece.vertices) for piece in self.pieces])

    @cached_property
    def corners(self) -> tuple[Vector, ...]:
        """Three vertices for each triangle of each piece, m."""
        return tuple(
            piece.vertices[index]
            for piece in self.pieces
            for triangle in piece.triangles
            for index in triangle
        )

    @cached_property
    def bounds(self) -> OrientedBox:
        """The smallest box around the solid along its own axes."""
        return _around(self.points)

    @cached_property
    def radius(self) -> float:
        """How far the solid reaches from its centre of mass, m."""
        return float(np.linalg.norm(self.points, axis=1).max())

    def extent(self, axis: Vector) -> float:
        """How far the solid reaches from its centre of mass along an axis, to either side, m."""
        return float(np.abs(_along(self.points, axis)).max())

    def stands_on(self, down: Vector) -> bool:
        """Whether it stands on a plane without turning: on points all around its middle.

        Args:
            down: Unit vector along an axis of its own, to where it would stand.
        """
        depths = _along(self.points, down)
        lowest = self.points[depths > depths.max() - FLAT]
        x, y = (lowest[:, axis] for axis in range(3) if down[axis] == 0.0)
        angles = np.sort(np.arctan2(y, x))
        gaps = np.diff(angles, append=angles[0] + 2.0 * math.pi)
        return bool(gaps.max() < math.pi)

    @cached_property
    def inertia(self) -> Vector:
        """Moments about the solid's own axes for a mass of 1 kg, m²; no products of inertia."""
        moments = self._moments
        xx, yy, zz = (np.sum([m[2] for m in moments], 0) / sum(m[0] for m in moments)).tolist()
        return (yy + zz, xx + zz, xx + yy)

    @cached_property
    def cores(self) -> tuple[OrientedBox, ...]:
        """A box inside each piece: what enters it surely enters the solid."""
        return tuple(map(_inside, self.pieces, self._moments))

    @cached_property
    def _moments(self) -> Sequence[Moments]:
        return tuple(map(_moments, self.pieces))

    @cached_property
    def digest(self) -> bytes:
        """Alike for the same pieces, in any process."""
        digest = hashlib.blake2b(digest_size=16)
        for piece in self.pieces:
            for part in (np.array(piece.vertices), np.array(piece.triangles, dtype=np.int64)):
                digest.update(str(part.shape).encode() + part.tobytes())
        return digest.digest()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Solid):
            return NotImplemented
        return self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def _along(vectors: Array, axis: Vector) -> Array:
    """The products of vectors, shape (n, 3), with an axis: the same bits on every processor."""
    x, y, z = axis
    products: Array = vectors[:, 0] * x + vectors[:, 1] * y + vectors[:, 2] * z
    return products


def _corners(piece: ConvexPiece) -> Array:
    """The corners of each triangle, shape (triangles, 3, 3)."""
    corners: Array = np.array(piece.vertices)[np.array(piece.triangles, dtype=np.intp)]
    return corners


def _moments(piece: ConvexPiece) -> Moments:
    """Volume in m³; first moments in m⁴; second moments xx, yy, zz in m⁵: of tetrahedra summed."""
    corners = _corners(piece)
    volumes = determinants(corners) / 6.0  # of the tetrahedra from the origin
    sums = corners.sum(1)
    firsts = (volumes[:, None] * sums).sum(0) / 4.0
    squares = np.square(sums) + np.square(corners).sum(1)
    return float(volumes.sum()), firsts, (volumes[:, None] * squares).sum(0) / 20.0


def _around(points: Array) -> OrientedBox:
    low, high = points.min(0), points.max(0)
    x, y, z = ((low + high) / 2).tolist()
    u, v, w = ((high - low) / 2).tolist()
    return OrientedBox(Pose((x, y, z)), (u, v, w))


def _inside(piece: ConvexPiece, moments: Moments) -> OrientedBox:
    """The box around a piece, shrunk about the piece's centre until it is inside."""
    corners = _corners(piece)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volume, firsts, _ = moments
    centre = firsts / volume
    half = np.array(_around(np.array(piece.vertices)).half)
    room = ((corners[:, 0] - centre) * normals).sum(1)  # to each face, times its normal's length
    share = max(0.0, float((room / _along(np.abs(normals), half.tolist())).min()))
    x, y, z = centre.tolist()
    u, v, w = (share * half).tolist()
    return OrientedBox(Pose((x, y, z)), (u, v, w))
