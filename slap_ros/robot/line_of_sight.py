# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one picture of a tag says exactly, and what it does not.

Across the line of sight, a tag is known to a fraction of a millimetre. How far away it is follows
from its size in the picture, and is off by millimetres, sometimes by centimetres. A tag that is
seen at a slant is narrow in the picture: it may seem to be anywhere within half a decimetre, or to
face the other way. So slanted tags do not count, and distance is taken from elsewhere: from what an
object stands on (``slap_ros.worlds.joint_space.settling``), or from the hand that holds it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from slap_ros.geometry.pose import Pose, Vector, rotate

SLANTED = 0.4  # cosine of the angle between a tag's normal and the line of sight, about 66 degrees
DISTANCE_ERROR = 0.03  # m, by which a tag may seem nearer or further away than it is


def is_slanted(seen: Pose) -> bool:
    """Whether a tag is seen too much from the side to say where it is.

    Args:
        seen: Pose of the tag in the camera's frame.
    """
    normal = rotate(seen.quaternion, (0.0, 0.0, 1.0))
    towards = -sum(a * b for a, b in zip(normal, seen.position, strict=True))
    return towards < SLANTED * math.hypot(*seen.position)


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
