# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies of triangles as SVG paths, as :mod:`slap_ros.drawing.projection` draws boxes.

Triangles that meet at a blunt edge are one face, drawn with one outline: a cylinder has three.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from math import hypot
from typing import NamedTuple

from slap_ros.core import VisibleBody
from slap_ros.drawing.projection import (
    EDGE_ON,
    LIGHT,
    LIT,
    SHADED,
    Canvas,
    Projection,
    box_paths,
    pose_of,
)
from slap_ros.geometry.pose import Vector, conjugate, dot, rotate

BLUNT = 0.8  # cosine between the normals of triangles of one face, at least
LEAST_AREA = 1e-12  # m²: thinner triangles are not drawn
MOST_TRIANGLES = 2000  # bodies of more are drawn as boxes

Edge = tuple[Vector, Vector]


class Triangle(NamedTuple):
    """Three corners, anticlockwise seen from outside, in the body's own frame."""

    corners: tuple[Vector, Vector, Vector]  # m
    normal: Vector  # of length 1


Face = tuple[Triangle, ...]


def body_paths(body: VisibleBody, view: Projection, canvas: Canvas) -> tuple[str, str, str]:
    """The visible faces of a body as paths: all of them, those in the light, those in the shade.

    Args:
        body: Body that is a box or has triangles.
        view: Projection that the body is seen in.
        canvas: Part of the view that is drawn, with the scale.
    """
    if not 0 < len(body.triangles) <= 3 * MOST_TRIANGLES:
        return box_paths(body, view, canvas)
    pose = pose_of(body)
    back = conjugate(pose.quaternion)
    toward, light = rotate(back, view.toward), rotate(back, LIGHT)
    paths = ["", "", ""]
    for face in _faces(body.triangles):
        seen = [triangle for triangle in face if dot(triangle.normal, toward) > EDGE_ON]
        lit = [triangle for triangle in seen if dot(triangle.normal, light) > LIT]
        shaded = [triangle for triangle in seen if dot(triangle.normal, light) < SHADED]
        for number, part in enumerate((seen, lit, shaded)):
            for outline in _outlines(part):
                paths[number] += canvas.path(view.project(pose.apply(p)) for p in outline)
    return paths[0], paths[1], paths[2]


@lru_cache(maxsize=256)
def _faces(corners: tuple[Vector, ...]) -> tuple[Face, ...]:
    """Triangles in groups that are bent nowhere."""
    triangles = list(_triangles(corners))
    by_edge: dict[Edge, list[int]] = defaultdict(list)
    for i, triangle in enumerate(triangles):
        for edge in _edges(triangle):
            by_edge[edge].append(i)
    faces, left = [], set(range(len(triangles)))
    while left:
        queue = [min(left)]
        left -= set(queue)
        face = []
        while queue:
            triangle = triangles[queue.pop()]
            face.append(triangle)
            for a, b in _edges(triangle):
                for i in by_edge[b, a]:
                    if i in left and dot(triangles[i].normal, triangle.normal) > BLUNT:
                        left.remove(i)
                        queue.append(i)
        faces.append(tuple(face))
    return tuple(faces)


def _triangles(corners: Sequence[Vector]) -> Iterator[Triangle]:
    for a, b, c in zip(corners[::3], corners[1::3], corners[2::3], strict=False):
        u, v, w = (q - p for p, q in zip(a, b, strict=True))
        x, y, z = (q - p for p, q in zip(a, c, strict=True))
        normal = (v * z - w * y, w * x - u * z, u * y - v * x)
        length = hypot(*normal)
        if length > LEAST_AREA:
            nx, ny, nz = (part / length for part in normal)
            yield Triangle((a, b, c), (nx, ny, nz))


def _edges(triangle: Triangle) -> tuple[Edge, Edge, Edge]:
    a, b, c = triangle.corners
    return ((a, b), (b, c), (c, a))


def _outlines(part: Iterable[Triangle]) -> Iterator[list[Vector]]:
    """The closed lines around triangles: the edges that no two of them share."""
    edges = [edge for triangle in part for edge in _edges(triangle)]
    known = set(edges)
    following: dict[Vector, list[Vector]] = defaultdict(list)
    for a, b in edges:
        if (b, a) not in known:
            following[a].append(b)
    while following:
        start = point = next(iter(following))
        line = []
        while point in following:
            line.append(point)
            ends = following[point]
            onwards = ends.pop()
            if not ends:
                del following[point]
            point = onwards
            if point == start:
                break
        yield line
