# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses of the grasp point: around a body, or where a held one stands in its place."""

from __future__ import annotations

import math
from collections.abc import Iterable

from slap_ros.domains.tabletop.state_access import grasp_of, yaw_of
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import State

DROP = 0.001  # m, height over its place at which a body is let go


def from_above(position: Vector, yaw: float) -> Pose:
    """The grasp point at a position, hand pointing down, fingers moving along the yaw's y."""
    return Pose(position, (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0))


def quarter_turns(yaw: float) -> list[float]:
    """The yaws from which a square looks the same, rad."""
    return [yaw + k * math.pi / 2 for k in range(4)]


def grasps_along_faces(pose: Pose) -> list[Pose]:
    """From above, fingers along the faces of a box that lies on one of them."""
    return [from_above(pose.position, yaw) for yaw in quarter_turns(yaw_of(pose))]


def grasps_to_stand(
    state: State,
    body: OrientedBox,
    place: tuple[float, float],
    height: float,
    yaws: Iterable[float],
) -> list[Pose]:
    """The poses of the grasp point at which the held body stands upright at a place.

    However the hand is tilted now, it points down there: so the body was grasped.

    Args:
        state: State with a held body.
        body: Box around the held body; only its height matters.
        place: Position x, y of the body's middle, m.
        height: Height of what the body is to stand on, m.
        yaws: Yaws that the body's faces may have, rad.

    Returns:
        A pose of the grasp point for each yaw, base's frame.
    """
    grasp = grasp_of(state)
    in_hand = yaw_of(from_above(ORIGIN, 0.0).compose(grasp))
    poses = []
    for yaw in yaws:
        upright = from_above(ORIGIN, yaw - in_hand).compose(grasp).quaternion
        stands = Pose((*place, height + body.half[2] + DROP), upright)
        poses.append(stands.compose(grasp.inverse()))
    return poses
