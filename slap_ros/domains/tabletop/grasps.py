# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses of the grasp point: around a body, or where a held one stands in its place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from enum import Enum

from slap_ros.domains.tabletop.state_access import grasp_of, yaw_of
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import ORIGIN, Pose, Quaternion, Vector, multiply, normalised, rotate
from slap_ros.relational import State

DROP = 0.001  # m, height over its place at which a body is let go
LEVEL = 0.02  # rad, by which a body may lean in a hand that points down: it comes to lie flat
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# Corners of open fingers at their tips, m, from the grasp point.
FINGERTIPS = tuple((x, y, 0.009) for x in (-0.0105, 0.0105) for y in (-0.0665, 0.0665))
CLEAR = 0.002  # m, at least, between them and what is below


class PutDown(Enum):
    """How a held body is put down."""

    AS_GRASPED = "as grasped"  # by a hand that points down
    LEVELLED = "levelled"  # its faces level, and the hand leans


def from_above(position: Vector, yaw: float) -> Pose:
    """The grasp point at a position, hand pointing down, fingers moving along the yaw's y."""
    return Pose(position, (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0))


def quarter_turns(yaw: float) -> list[float]:
    """The yaws from which a square looks the same, rad."""
    return [yaw + k * math.pi / 2 for k in range(4)]


def grasps_along_faces(pose: Pose) -> list[Pose]:
    """From above, fingers along the faces of a box that lies on one of them."""
    return [from_above(pose.position, yaw) for yaw in quarter_turns(yaw_of(pose))]


def ways_to_put_down(state: State) -> Iterator[PutDown]:
    """In the order in which they are tried: levelled first where a body has turned in the hand.

    Fingers of a robot hold by friction: what is pushed against others turns and slips.
    """
    turn = from_above(ORIGIN, 0.0).compose(grasp_of(state)).quaternion
    if abs(_upright_axis(turn)[2]) < math.cos(LEVEL):
        yield PutDown.LEVELLED
    yield PutDown.AS_GRASPED


def grasps_to_stand(
    state: State,
    body: OrientedBox,
    place: tuple[float, float],
    height: float,
    yaws: Iterable[float],
    how: PutDown = PutDown.AS_GRASPED,
) -> list[Pose]:
    """The poses of the grasp point at which the held body stands upright at a place.

    However the hand is tilted now, it points down there, for so the body was grasped; unless the
    body is to be levelled.

    Args:
        state: State with a held body.
        body: Box around the held body; only its height matters.
        place: Position x, y of the body's middle, m.
        height: Height of what the body is to stand on, m.
        yaws: Yaws that the body's faces may have, rad.
        how: How it is put down.

    Returns:
        A pose of the grasp point for each yaw, base's frame.
    """
    grasp = grasp_of(state)
    in_hand = yaw_of(from_above(ORIGIN, 0.0).compose(grasp))
    middle = (*place, height + body.half[2] + DROP)
    turns = [from_above(ORIGIN, yaw - in_hand).compose(grasp).quaternion for yaw in yaws]
    if how is PutDown.AS_GRASPED:
        return [Pose(middle, turn).compose(grasp.inverse()) for turn in turns]
    levelled = [Pose(middle, level(turn)).compose(grasp.inverse()) for turn in turns]
    return [_fingers_over(height + CLEAR, pose) for pose in levelled]


def _fingers_over(height: float, grasp_point: Pose) -> Pose:
    """The pose raised until open fingers, which may reach below the body, stay over a height."""
    (x, y, z), turn = grasp_point
    lowest = min(grasp_point.apply(corner)[2] for corner in FINGERTIPS)
    return Pose((x, y, z + max(0.0, height - lowest)), turn)


def level(turn: Quaternion) -> Quaternion:
    """The rotation nearest to one at which the faces of a box are level.

    Args:
        turn: Rotation of the box.
    """
    x, y, z = _upright_axis(turn)
    if z < 0.0:
        x, y, z = -x, -y, -z
    return multiply(normalised((y, -x, 0.0, 1.0 + z)), turn)  # takes that axis to the vertical


def _upright_axis(turn: Quaternion) -> Vector:
    """The axis of a turned box that is nearest to the vertical."""
    return max((rotate(turn, axis) for axis in AXES), key=lambda axis: abs(axis[2]))
