# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shapes of the arm's links: boxes with rounded edges around the hulls of the moving ones.

Fitted once to the convex hulls of the Panda's collision meshes as pybullet_data ships them, for
least volume, then rounded outwards: every vertex is inside.
"""

from __future__ import annotations

from typing import NamedTuple

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose


class RoundedBox(NamedTuple):
    """All points within ``radius`` (m) of a box that is fixed to a link."""

    link: str
    box: OrientedBox  # its pose is in the link's frame
    radius: float


# Around link 0 and, wherever joint 1 turns it, link 1.
BASE = OrientedBox(Pose((-0.006, 0.0, 0.195)), (0.153, 0.147, 0.198))

_STRAIGHT = (0.0, 0.0, 0.0, 1.0)
_EIGHTH_TURN = (0.0, 0.0, 0.3827, 0.9239)
_TURN_3 = (-0.0669, -0.3758, 0.1659, 0.9093)
_TURN_4 = (-0.1597, -0.0664, 0.3730, 0.9116)
_FINGER = OrientedBox(Pose((0.0, 0.013, 0.027), _STRAIGHT), (0.010, 0.013, 0.027))


def _link(
    link: str,
    centre: tuple[float, float, float],
    turn: tuple[float, float, float, float],
    half: tuple[float, float, float],
    radius: float,
) -> RoundedBox:
    return RoundedBox(link, OrientedBox(Pose(centre, turn), half), radius)


ARM_SHAPES = (
    _link("link1", (0.0, -0.019, -0.075), (0.194, 0.0, 0.0, 0.981), (0.005, 0.021, 0.091), 0.0570),
    _link("link2", (0.0, -0.076, 0.035), (0.148, 0.0, 0.0, 0.989), (0.037, 0.120, 0.053), 0.0193),
    _link("link3", (0.042, 0.020, -0.041), _TURN_3, (0.064, 0.004, 0.001), 0.0659),
    _link("link4", (-0.041, 0.042, 0.021), _TURN_4, (0.000, 0.063, 0.002), 0.0680),
    _link(
        "link5", (0.0, 0.037, -0.119), (-0.1078, 0.0, 0.0, 0.9942), (0.010, 0.019, 0.133), 0.0474
    ),
    _link(
        "link6", (0.042, 0.015, 0.010), (0.0, 0.1112, 0.0, 0.9938), (0.090, 0.065, 0.043), 0.0017
    ),
    _link("link7", (0.012, 0.012, 0.078), _EIGHTH_TURN, (0.063, 0.037, 0.021), 0.0085),
    _link("hand", (0.0, 0.0, 0.023), _STRAIGHT, (0.002, 0.079, 0.020), 0.0297),
    RoundedBox("left_finger", _FINGER, 0.0006),
    RoundedBox("right_finger", _FINGER, 0.0006),
)
BEHIND_ELBOW = [shape.link for shape in ARM_SHAPES].index("link5")  # from here on
