# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The links that can touch something, and the boxes around their shapes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Quaternion, Vector
from slap_ros.worlds.panda import LINKS


@dataclass(frozen=True)
class LinkShape:
    """A link's shape: a file of convex vertices, and the box around them in the link's frame."""

    link: int  # index in panda.LINKS
    mesh: str  # file name in pybullet_data's franka_panda/meshes/collision
    frame: Pose
    half: Vector

    def at(self, link: Pose) -> OrientedBox:
        """The box around the link where the link is at that pose."""
        return OrientedBox(link.compose(self.frame), self.half)

    @property
    def radius(self) -> float:
        """Half the box's diagonal, m."""
        return math.hypot(*self.half)


def _shape(name: str, mesh: str, low: Vector, high: Vector, tilt: float = 0.0) -> LinkShape:
    """Corners in m, in a frame that is tilted about the link's x by ``tilt`` rad."""
    turn: Quaternion = (math.sin(tilt / 2), 0.0, 0.0, math.cos(tilt / 2))
    x, y, z = ((a + b) / 2 for a, b in zip(low, high, strict=True))
    u, v, w = ((b - a) / 2 for a, b in zip(low, high, strict=True))
    centre = Pose(quaternion=turn).apply((x, y, z))
    return LinkShape(LINKS.index(name), mesh, Pose(centre, turn), (u, v, w))


_FINGER = ((-0.0105, -0.0002, 0.0001), (0.0105, 0.0265, 0.0539))
# The base and the two links that turn about it reach nothing that stands in front of the robot.
LINK_SHAPES = (
    _shape("link3", "link3.obj", (-0.0547, -0.0550, -0.1211), (0.1376, 0.1113, 0.0552)),
    _shape("link4", "link4.obj", (-0.1377, -0.0552, -0.0553), (0.0552, 0.1241, 0.1111)),
    _shape(
        "link5",
        "link5.obj",
        (-0.0551, 0.0018, -0.2646),
        (0.0551, 0.1321, 0.0743),
        tilt=math.radians(-14.0),
    ),
    _shape("link6", "link6.obj", (-0.0480, -0.0513, -0.0443), (0.1324, 0.0817, 0.0564)),
    _shape("link7", "link7.obj", (-0.0441, -0.0441, 0.0519), (0.0814, 0.0812, 0.1069)),
    _shape("hand", "hand.obj", (-0.0317, -0.1040, -0.0260), (0.0317, 0.1005, 0.0660)),
    _shape("left_finger", "finger.obj", *_FINGER),
    _shape("right_finger", "finger.obj", *_FINGER),
)
