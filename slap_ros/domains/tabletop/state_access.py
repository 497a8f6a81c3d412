# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading a state of a Panda among bodies: plain floats and poses. Lengths in m, base frame."""

from __future__ import annotations

import math
from functools import lru_cache

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, rotate
from slap_ros.motion import Joints
from slap_ros.relational import Column, Layout, Object, State
from slap_ros.worlds.features import BODY_FEATURES, JOINT_FEATURES, pose_of
from slap_ros.worlds.joint_space.features import GRASP_FEATURES, ROBOT
from slap_ros.worlds.panda import GRASP_POINT

JOINT_NAMES = tuple(feature.name for feature in JOINT_FEATURES)
GRASP_NAMES = tuple(feature.name for feature in GRASP_FEATURES)
HALF_NAMES = ("half_x", "half_y", "half_z")  # of what is a box: half its edges


@lru_cache(maxsize=256)
def bodies(layout: Layout) -> Column:
    """The objects that move by themselves and can be held."""
    features = set(BODY_FEATURES)
    return Column(tuple(obj for obj in layout.objects if features <= set(obj.type.features)))


def held_body(state: State) -> Object | None:
    """The body in the hand; None if there is none."""
    for body in bodies(state.layout).objects:
        if state.get(body, "held") > 0.5:
            return body
    return None


def joints_of(state: State) -> Joints:
    """Joint positions, rad, shape (7,)."""
    joints: Joints = state.gather(state.layout.column_of(ROBOT), JOINT_NAMES)[0]
    return joints


def finger_of(state: State) -> float:
    """Distance of each finger from the middle."""
    return float(state.get(robot_of(state), "finger"))


def grasp_of(state: State) -> Pose:
    """The held body's pose seen from the grasp point."""
    x, y, z, qx, qy, qz, qw = _features(state, robot_of(state), GRASP_NAMES)
    return Pose((x, y, z - GRASP_POINT), (qx, qy, qz, qw))


def box_of(state: State, obj: Object) -> OrientedBox:
    """An object that is a box, and says so by its features."""
    half_x, half_y, half_z = _features(state, obj, HALF_NAMES)
    return OrientedBox(pose_of(state, obj), (half_x, half_y, half_z))


def yaw_of(pose: Pose) -> float:
    """The turn about the vertical of a box that lies on a face, up to quarter turns, rad."""
    axes = [rotate(pose.quaternion, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    x, y, _ = min(axes, key=lambda axis: abs(axis[2]))  # one that lies flat
    return math.atan2(y, x)


def robot_of(state: State) -> Object:
    """The only robot."""
    (robot,) = state.layout.of_type(ROBOT)
    return robot


def _features(state: State, obj: Object, names: tuple[str, ...]) -> list[float]:
    values: list[float] = state.gather(Column.of(obj), names)[0].tolist()
    return values
