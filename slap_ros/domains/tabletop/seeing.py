# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees of a Panda among bodies: joints, and everything else from the hand."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from slap_ros.domains.tabletop.reading import GRASP_NAMES, JOINT_NAMES, bodies
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, arm_frames, matrix
from slap_ros.physics.features import ROBOT
from slap_ros.physics.panda import GRASP_POINT, JOINT_HIGH, JOINT_LOW, JOINTS, MAX_STEP
from slap_ros.physics.scene import TABLE_TOP
from slap_ros.relational import Column, Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

FAR = 0.2  # m, the scale of what is seen
FAST = 0.5  # m/s
STILL = 0.05  # m/s and rad/s, along each axis: a body so slow stays where it is
AT_EASE = 0.8  # of a joint's range, from its middle to its limit
OFF_CENTRE = 0.02  # m, the scale of where in the fingers a body is held
SWIFT = 0.05  # m, the scale of how far the hand goes in a control step
AT_IT = 0.02  # m, below which the way to a thing has no direction to speak of

POSITION = ("x", "y", "z")
VELOCITY = ("vx", "vy", "vz")
TWIST = (*VELOCITY, "wx", "wy", "wz")
_MIDDLE = (np.array(JOINT_HIGH) + JOINT_LOW) / 2
_HALF_RANGE = (np.array(JOINT_HIGH) - JOINT_LOW) / 2
_GRASP_FRAME = matrix(GRASP_IN_LAST_LINK)
_GRASP_OFFSET = np.array([0.0, 0.0, GRASP_POINT])


def hand(state: State) -> Array:
    """Frame of the point between the fingertips, shape (n, 4, 4)."""
    frame: Array = arm_frames(_joints(state))[:, -1] @ _GRASP_FRAME
    return frame


def moving_hand(state: State) -> Array:
    """Beside its frame how far each joint moves the hand in a control step at full speed, m.

    Shape (n, 4, 4 + joints), the last row of what is beside the frame 0.
    """
    links = arm_frames(_joints(state))
    frame = links[:, -1] @ _GRASP_FRAME
    levers = frame[:, None, :3, 3] - links[:, :, :3, 3]
    moves = np.cross(links[:, :, :3, 2], levers) * np.array(MAX_STEP)[:, None]
    beside = np.pad(moves, ((0, 0), (0, 0), (0, 1))).swapaxes(1, 2)
    return np.concatenate([frame, beside], axis=-1)


def along(hand: Array, ways: Array) -> Array:
    """How far each joint takes a moving hand along some ways, in SWIFT, (n, ways, joints).

    What it takes to go somewhere differs with the arm's configuration; a small network that is
    shown joints and places would have to learn the arm's kinematics first.

    Args:
        hand: What :func:`moving_hand` gives.
        ways: m, shape (n, ways, 3).
    """
    lengths = np.sqrt(np.square(ways).sum(axis=-1, keepdims=True))
    directions = ways / np.maximum(lengths, AT_IT)
    far: Array = directions @ hand[:, :3, 4:] / SWIFT
    return far


def grasp_point(joints: Array) -> Array:
    """Where the point between the fingertips is, m: joint positions (..., 7) to (..., 3)."""
    frames = arm_frames(joints.reshape(-1, JOINTS))[:, -1]
    points: Array = (frames @ _GRASP_FRAME[:, 3])[:, :3]
    return points.reshape(*joints.shape[:-1], 3)


def robot(state: State, hand: Array) -> Array:
    """Joints over their ranges; hand: x and z axes, height; what it holds, from the hand."""
    layout = state.layout
    held = state.stack(bodies(layout), "held").max(axis=-1, keepdims=True)
    offset = state.gather(layout.column_of(ROBOT), GRASP_NAMES[:3])[:, 0] - _GRASP_OFFSET
    joints = _over_ranges(state)
    height = (hand[:, 2, 3:4] - TABLE_TOP) / FAR
    axes = (hand[:, :3, 0], hand[:, :3, 2])
    return np.concatenate([joints, *axes, height, held, held * offset / OFF_CENTRE], axis=-1)


def strain(state: State) -> Array:
    """How far joints are beyond where they are at ease, 1 for each at its limit, shape (n,)."""
    beyond = np.maximum(np.abs(_over_ranges(state)) - AT_EASE, 0.0) / (1.0 - AT_EASE)
    summed: Array = np.square(beyond).sum(axis=-1)
    return summed


def place(state: State, hand: Array, column: Column) -> Array:
    """Where things are from the hand, along the base's axes, shape (n, objects, 3)."""
    seen: Array = from_hand(state, hand, column) / FAR
    return seen


def speed(state: State, column: Column) -> Array:
    """How fast bodies move, shape (n, objects, 3)."""
    return np.clip(state.gather(column, VELOCITY) / FAST, -3, 3)


def nothing(state: State, column: Column) -> Array:
    """No features, shape (n, objects, 0): of the robot, which is seen already."""
    return np.zeros((*state.data.shape[:-1], len(column.objects), 0))


def never_near(state: State, column: Column) -> Array:
    """Distances to what there is no point in going to, m, shape (n, objects)."""
    return np.full((*state.data.shape[:-1], len(column.objects)), np.inf)


def to_over(state: State, hand: Array, column: Column, height: float) -> Array:
    """From the hand to ``height`` m over the middles of things, m, shape (n, objects)."""
    ways = ways_over(state, hand, column, height)
    distance: Array = np.sqrt(np.square(ways).sum(axis=-1))
    return distance


def ways_over(state: State, hand: Array, column: Column, height: float) -> Array:
    """The ways from the hand to ``height`` m over the middles of things, m, (n, objects, 3)."""
    ways: Array = from_hand(state, hand, column) + np.array([0.0, 0.0, height])
    return ways


def from_hand(state: State, hand: Array, column: Column) -> Array:
    """Positions less that of the hand, m, shape (n, objects, 3)."""
    seen: Array = state.gather(column, POSITION) - hand[:, None, :3, 3]
    return seen


def apart(state: State, thing: Object, column: Column) -> Array:
    """From middle to middle, or from the robot's hand, m, shape (n, objects)."""
    if thing.type.is_a(ROBOT):
        return to_over(state, hand(state), column, 0.0)
    way = state.gather(column, POSITION) - state.gather(alone(thing), POSITION)
    distance: Array = np.sqrt(np.square(way).sum(axis=-1))
    return distance


def settled(state: State) -> Bools:
    """Whether no body moves any more, shape (n,)."""
    twists = np.abs(state.gather(bodies(state.layout), TWIST))
    still: Bools = twists.max(axis=(-2, -1)) < STILL
    return still


def lower_than(height: float) -> Callable[[State], Bools]:
    """Whether a body's middle is lower than so many m, as it is once it fell: shape (n,)."""

    def lost(state: State) -> Bools:
        fallen: Bools = state.stack(bodies(state.layout), "z").min(axis=-1) < height
        return fallen

    return lost


@lru_cache(maxsize=256)
def alone(obj: Object) -> Column:
    """A column of one object."""
    return Column((obj,))


def _joints(state: State) -> Array:
    joints: Array = state.gather(state.layout.column_of(ROBOT), JOINT_NAMES)[:, 0]
    return joints


def _over_ranges(state: State) -> Array:
    """Joints over their ranges, from -1 to 1, shape (n, 7)."""
    joints: Array = (_joints(state) - _MIDDLE) / _HALF_RANGE
    return joints
