# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where on a body tags have room: on the flat faces of its parts, all of one size.

A small tag fits on every face, and a large one is seen from further away. Of the sizes that fit on
a face, the one is taken with which the body has tags of the largest size towards most directions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from slap_ros.geometry.oriented_box import UP, OrientedBox
from slap_ros.geometry.pose import Pose, Quaternion, Vector, from_yaw, multiply, rotate
from slap_ros.vision.tags import SHARE_OF_FACE
from slap_ros.worlds.contact.scene import INSCRIBED, BoxPart, Part

SMALLEST_PLACED = 0.015  # m; across a table, smaller ones seem to be centimetres off
SIZE_STEP = 0.0005  # m, of which sizes are multiples
MOST_IN_A_ROW = 4  # on a long face; the outermost, since hands grasp in the middle
CLEARANCE = 0.001  # m, before a tag, within which nothing else of the body is
ASIDE = 1e-4  # m, by which what is beside a tag may reach over its edge
UPRIGHT: Quaternion = (0.5, 0.5, 0.5, 0.5)  # of a tag on the face towards x, its y axis upwards
UPSIDE_DOWN: Quaternion = (1.0, 0.0, 0.0, 0.0)


class TagPlaces(NamedTuple):
    """Where a body has tags."""

    size: float  # m, edge of each tag's black square
    poses: tuple[Pose, ...]  # of the tags in the body's frame


class Face(NamedTuple):
    """A flat rectangle; its frame is that of a tag in its middle, in the body's frame."""

    pose: Pose
    half_x: float  # m
    half_y: float  # m

    @property
    def size(self) -> float:
        """The size of the largest tag on it, m."""
        edge = 2.0 * min(self.half_x, self.half_y)
        return SIZE_STEP * math.floor(SHARE_OF_FACE * edge / SIZE_STEP + 1e-6)

    def row(self, edge: float) -> Iterator[Pose]:
        """Where squares lie in a row along the longer edge.

        Args:
            edge: Edge of the squares, m.
        """
        long = max(self.half_x, self.half_y)
        number = math.floor(2.0 * long / edge + 1e-6)
        for i in range(number):
            along = long * ((2.0 * i + 1.0) / number - 1.0)
            x, y = (along, 0.0) if self.half_x >= self.half_y else (0.0, along)
            yield self.pose.compose(Pose((x, y, 0.0)))


def tag_places(parts: Sequence[Part]) -> TagPlaces:
    """The places of tags on a body.

    Args:
        parts: Parts of the body, or of its moving part, in one frame.

    Returns:
        Their size and their poses; a size below :data:`SMALLEST_PLACED` where no tag has room.
    """
    faces = [face for part in parts for face in _faces(part)]
    sizes = {face.size for face in faces}
    found = [_of_size(size, faces, parts) for size in sizes if size >= SMALLEST_PLACED]
    return max(found, key=_worth, default=TagPlaces(max(sizes), ()))


def face_poses(half: Vector) -> tuple[Pose, ...]:
    """The poses of tags in the middle of a box's faces: top, +x, +y, -x, -y, bottom.

    Args:
        half: Half the edges of the box, m.
    """
    x, y, z = half
    sides = ((x, 0.0, 0.0), (0.0, y, 0.0), (-x, 0.0, 0.0), (0.0, -y, 0.0))
    return (
        Pose((0.0, 0.0, z)),
        *(
            Pose(middle, multiply(from_yaw(0.5 * math.pi * quarter), UPRIGHT))
            for quarter, middle in enumerate(sides)
        ),
        Pose((0.0, 0.0, -z), UPSIDE_DOWN),
    )


def _faces(part: Part) -> Iterator[Face]:
    """A box's six faces; of a cylinder, the square inside each end."""
    if isinstance(part, BoxPart):
        x, y, z = part.half_extents_m
        halves = ((x, y), (y, z), (x, z), (y, z), (x, z), (x, y))
        for pose, (half_x, half_y) in zip(face_poses((x, y, z)), halves, strict=True):
            yield Face(part.pose.compose(pose), half_x, half_y)
    else:
        half = INSCRIBED * part.radius_m
        top, *_, bottom = face_poses((half, half, 0.5 * part.length_m))
        for pose in (top, bottom):
            yield Face(part.pose.compose(pose), half, half)


def _of_size(size: float, faces: Iterable[Face], parts: Sequence[Part]) -> TagPlaces:
    """Tags of a size on all faces that have room for them."""
    edge, taken = size / SHARE_OF_FACE, [part.bounding_box for part in parts]
    poses: list[Pose] = []
    for face in faces:
        if face.size < size:
            continue
        free = [pose for pose in face.row(edge) if not _is_covered(_space(pose, edge), taken)]
        free.sort(key=lambda pose: -math.dist(pose.position, face.pose.position))
        poses += free[:MOST_IN_A_ROW]
        taken += [_space(pose, edge) for pose in free[:MOST_IN_A_ROW]]
    return TagPlaces(size, tuple(poses))


def _space(pose: Pose, edge: float) -> OrientedBox:
    """The space before a tag, which nothing else of the body is to be in."""
    before, half = Pose((0.0, 0.0, ASIDE + 0.5 * CLEARANCE)), 0.5 * edge - ASIDE
    return OrientedBox(pose.compose(before), (half, half, 0.5 * CLEARANCE))


def _is_covered(space: OrientedBox, taken: Iterable[OrientedBox]) -> bool:
    return any(space.overlaps(box) for box in taken)


def _worth(places: TagPlaces) -> float:
    """How well a body with these tags is seen: their size, by the directions that have any."""
    normals = {
        tuple(round(part, 6) + 0.0 for part in rotate(pose.quaternion, UP)) for pose in places.poses
    }
    return places.size * (len(normals) - 1)
