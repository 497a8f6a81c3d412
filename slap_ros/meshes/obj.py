# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Convex pieces as Wavefront OBJ: an object a piece, lengths in m."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.errors import InvalidMeshError
from slap_ros.geometry.pose import Vector
from slap_ros.meshes.solid import ConvexPiece


def to_obj(pieces: Sequence[ConvexPiece]) -> str:
    """The text of a file; floats are written so that they are read back to the bit."""
    lines, first = [], 1
    for number, (vertices, triangles) in enumerate(pieces):
        lines.append(f"o piece{number}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in triangles]
        first += len(vertices)
    return "\n".join([*lines, ""])


def from_obj(text: str) -> list[ConvexPiece]:
    """The pieces in the text of a file: convex objects, one after the other.

    Raises:
        InvalidMeshError: Not such a file; names the line.
    """
    vertices: list[list[Vector]] = []
    faces: list[list[tuple[int, int, int]]] = []
    first = 1
    for number, line in enumerate(text.splitlines(), start=1):
        keyword, *words = line.split() or ("#",)
        try:
            if keyword == "o":
                first += len(vertices[-1]) if vertices else 0
                vertices.append([])
                faces.append([])
            elif keyword == "v":
                x, y, z = map(float, words)
                vertices[-1].append((x, y, z))
            elif keyword == "f":
                a, b, c = (_index(word, first, len(vertices[-1])) for word in words)
                faces[-1].append((a, b, c))
        except (ValueError, IndexError) as error:
            raise InvalidMeshError(
                f"line {number}, {line!r}: want objects (o), each with vertices (v x y z) and "
                "triangles (f a b c) of its own"
            ) from error
    return [ConvexPiece(tuple(v), tuple(f)) for v, f in zip(vertices, faces, strict=True)]


def _index(word: str, first: int, count: int) -> int:
    """A vertex by its number in the file; what follows a slash is texture and shading."""
    index = int(word.partition("/")[0]) - first
    if not 0 <= index < count:
        raise ValueError(f"no such vertex: {word}")
    return index
