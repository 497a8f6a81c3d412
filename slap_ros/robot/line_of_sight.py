# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one picture of a tag says exactly, and what it does not.

Across the line of sight, a tag is known to a fraction of a millimetre. How far away it is follows
from its size in the picture, and is off by millimetres, or by centimetres where a finger covers an
edge of it. A tag that is seen at a slant is narrow in the picture: it may seem to be anywhere
within half a decimetre, or to face the other way. So slanted tags do not count, and distance is
taken from elsewhere: from what an object stands on (``slap_ros.worlds.joint_space.settling``), or
from the hand that holds it.

A tag of a few pixels looks almost the same where it is turned the other way in depth. A finger over
one corner is enough for the wrong one of both to fit better. Where the object was says which it is,
or that it lies on a table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from slap_ros.geometry.pose import Pose, Quaternion, Vector, multiply, rotate
from slap_ros.worlds.settling import DISTANCE_ERROR, levelled

SLANTED = 0.4  # cosine of the angle between a tag's normal and the line of sight, about 66 degrees
HALF_TURN: Quaternion = (0.0, 0.0, 1.0, 0.0)  # about a tag's normal
LIKE_BEFORE = 0.5  # rad, by which what has not rolled over may have turned since it was seen


def is_slanted(seen: Pose) -> bool:
    """Whether a tag is seen too much from the side to say where it is.

    Args:
        seen: Pose of the tag in the camera's frame.
    """
    normal = rotate(seen.quaternion, (0.0, 0.0, 1.0))
    towards = -sum(a * b for a, b in zip(normal, seen.position, strict=True))
    return towards < SLANTED * math.hypot(*seen.position)


def mirrored(seen: Pose) -> Pose:
    """The other way in which a tag may face: its depth is turned round, its picture is the same.

    It is the second minimum of the error in the picture (Collins and Bartoli 2014), but for the
    perspective within the tag.

    Args:
        seen: Pose of the tag in the camera's frame.
    """
    length = math.hypot(*seen.position)
    if length == 0.0:  # inside the camera
        return seen
    x, y, z = (part / length for part in seen.position)
    turned = multiply((x, y, z, 0.0), multiply(seen.quaternion, HALF_TURN))
    return Pose(seen.position, turned)


class Ways(NamedTuple):
    """The two places of an object that explain the picture of a tag on it, in the base's frame."""

    seen: Pose  # which fits better
    other: Pose  # with the tag mirrored

    @classmethod
    def of(cls, base: Pose, seen: Pose, offset: Pose) -> Ways:
        """Both, of an object with a tag.

        Args:
            base: Pose of the camera in the base's frame.
            seen: Pose of the tag in the camera's frame.
            offset: Pose of the object in the tag's frame.
        """
        return cls(*(base.compose(way).compose(offset) for way in (seen, mirrored(seen))))

    def in_hand(self, expected: Pose) -> Pose:
        """The one that is turned like what the hand holds.

        Args:
            expected: Pose in which the hand should have it, base's frame.
        """
        return self.other if _like(self.other, expected) > _like(self.seen, expected) else self.seen

    def at_rest(self, last: Pose | None) -> Pose:
        """The one that is turned as before, or that lies flat; as seen where both do.

        Args:
            last: Pose in which the object lay last, base's frame; None where that is not known.
        """
        if last is not None and _like(self.seen, last):
            return self.seen
        if levelled(self.other) is None:
            return self.seen
        as_before = last is not None and _like(self.other, last)
        return self.other if as_before or levelled(self.seen) is None else self.seen


def _like(pose: Pose, before: Pose) -> bool:
    return pose.angle_to(before) <= LIKE_BEFORE


def across(offset: Sequence[float], point: Vector, eye: Vector | None) -> Vector:
    """An offset between two places, without what an error of the distance explains.

    Args:
        offset: From one place to the other, m.
        point: One of the places, m.
        eye: Where the camera is, m; None where no camera says how far away things are.
    """
    x, y, z = offset
    if eye is None or point == eye:
        return (x, y, z)
    sight = [a - b for a, b in zip(point, eye, strict=True)]
    along = sum(a * b for a, b in zip(offset, sight, strict=True)) / math.hypot(*sight)
    along = min(max(along, -DISTANCE_ERROR), DISTANCE_ERROR)
    part = along / math.hypot(*sight)
    return (x - part * sight[0], y - part * sight[1], z - part * sight[2])
