# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading a state of a hand among bodies: single ones as plain floats, batches as arrays. SI units.

What reads a batch takes a column of objects and gives one row per object.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.benchtop.features import THING
from slap_ros.geometry.pose import Pose, Vector, rotate
from slap_ros.geometry.rotations import rotate_each, x_axes
from slap_ros.relational import Column, Layout, Object, State
from slap_ros.relational.state import Array
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import wrapped
from slap_ros.worlds.features import pose_of

POSITION = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
LINEAR = ("vx", "vy", "vz")
ANGULAR = ("wx", "wy", "wz")
TARGET = ("target_x", "target_y", "target_z")


# -- single states --------------------------------------------------------------------------------


def robot_of(layout: Layout) -> Object:
    """The robot, of which there is one."""
    (robot,) = layout.of_type(ROBOT)
    return robot


def value(state: State, obj: Object, feature: str) -> float:
    """One feature of an object.

    Args:
        state: A single state.
        obj: Object of the state.
        feature: Name of the feature.
    """
    return float(state.get(obj, feature))


def position_of(state: State, obj: Object) -> Vector:
    """Where an object's origin is, m."""
    x, y, z = (float(state.get(obj, axis)) for axis in POSITION)
    return (x, y, z)


def axis_of(state: State, obj: Object) -> Vector:
    """The direction of an object's own x axis, of length 1."""
    return rotate(pose_of(state, obj).quaternion, (1.0, 0.0, 0.0))


def yaw_of(state: State, obj: Object) -> float:
    """How an object's own x axis is turned about the vertical, rad."""
    x, y, _ = axis_of(state, obj)
    return math.atan2(y, x)


def hand_position(state: State) -> Vector:
    """Where the grasp point between the fingertips is, m."""
    return position_of(state, robot_of(state.layout))


def hand_pose(state: State) -> Pose:
    """Where the hand is: its frame is the grasp point's, z downwards, fingers along y."""
    return pose_of(state, robot_of(state.layout))


def hand_target(state: State) -> tuple[Vector, float]:
    """Where the hand is pulled: position in m, and yaw in rad."""
    robot = robot_of(state.layout)
    x, y, z = (float(state.get(robot, name)) for name in TARGET)
    return (x, y, z), float(state.get(robot, "target_yaw"))


def hand_yaw(state: State) -> float:
    """How the hand is turned about the vertical, rad, within half a turn of its target."""
    qx, qy, _, _ = hand_pose(state).quaternion
    _, target = hand_target(state)
    return target + wrapped(2.0 * math.atan2(qy, qx) - target)


def finger_opening(state: State) -> float:
    """The distance between the fingers' pads, m."""
    robot = robot_of(state.layout)
    return float(state.get(robot, "left_finger") + state.get(robot, "right_finger"))


def things_of(layout: Layout) -> tuple[Object, ...]:
    """The free bodies of a layout."""
    return layout.of_type(THING)


def held_thing(state: State) -> Object | None:
    """The thing that both fingers press on; None where they hold nothing."""
    for thing in things_of(state.layout):
        if state.get(thing, "held") > 0.5:
            return thing
    return None


def standing_on(state: State, thing: Object, place: Object) -> Vector:
    """Where a thing's origin is when it stands on the middle of a place.

    Args:
        state: A single state.
        thing: Thing that stands on the place, or will stand there.
        place: Place that the thing stands on.

    Returns:
        Position, m.
    """
    x, y, z = position_of(state, place)
    top = z + value(state, place, "support_height")
    return (x, y, top + value(state, thing, "rest_height"))


# -- batches --------------------------------------------------------------------------------------


def hand_positions(state: State) -> Array:
    """Where the grasp point is, m, shape (..., 1, 3)."""
    return state.gather(state.layout.column_of(ROBOT), POSITION)


def positions(state: State, column: Column) -> Array:
    """Where objects are, m, shape (..., objects, 3)."""
    return state.gather(column, POSITION)


def axes(state: State, column: Column) -> Array:
    """The directions of objects' own x axes, shape (..., objects, 3)."""
    return x_axes(state.gather(column, QUATERNION))


def in_base(state: State, column: Column, points: Array) -> Array:
    """Where points of objects are in the base's frame, m.

    Args:
        state: A state or a batch of states.
        column: Objects that have the points.
        points: Points in the objects' own frames, m, shape (..., objects, 3).

    Returns:
        Of the same shape.
    """
    return positions(state, column) + rotate_each(state.gather(column, QUATERNION), points)


def distances(points: Array, others: Array) -> Array:
    """How far points are from others, m; coordinates last."""
    apart: Array = np.linalg.norm(points - others, axis=-1)
    return apart
