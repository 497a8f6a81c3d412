# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner observes of a Panda among bodies: joints, and all else relative to the hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slap_ros.domains.tabletop.state_access import GRASP_NAMES, JOINT_NAMES, bodies
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, arm_frames, matrix
from slap_ros.relational import Column, Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import TABLE_TOP
from slap_ros.worlds.panda import GRASP_POINT, JOINT_HIGH, JOINT_LOW, JOINTS, MAX_STEP

DISTANCE_SCALE = 0.2  # m, the scale of what is seen
SPEED_SCALE = 0.5  # m/s
REST_SPEED = 0.05  # m/s and rad/s, along each axis: a body so slow stays where it is
COMFORTABLE_RANGE = 0.8  # of a joint's range, from its middle to its limit
GRASP_OFFSET_SCALE = 0.02  # m, the scale of where in the fingers a body is held
STEP_SCALE = 0.05  # m, the scale of how far the hand goes in a control step
DIRECTION_THRESHOLD = 0.02  # m, below which the way to a thing has no direction to speak of

POSITION = ("x", "y", "z")
VELOCITY = ("vx", "vy", "vz")
TWIST = (*VELOCITY, "wx", "wy", "wz")
_MIDDLE = (np.array(JOINT_HIGH) + JOINT_LOW) / 2
_HALF_RANGE = (np.array(JOINT_HIGH) - JOINT_LOW) / 2
_GRASP_FRAME = matrix(GRASP_IN_LAST_LINK)
_MAX_STEP = np.array(MAX_STEP)
_GRASP_OFFSET = np.array([0.0, 0.0, GRASP_POINT])


def hand_frame(state: State) -> Array:
    """Frame of the point between the fingertips, shape (n, 4, 4)."""
    return _hand_frame(arm_frames(_joints(state)))


def hand_frame_and_velocities(state: State) -> Array:
    """Beside its frame how far each joint moves the hand in a control step at full speed, m.

    Returns:
        Shape (n, 4, 4 + joints): the frame, then a column for each joint whose last row is 0.
    """
    links = arm_frames(_joints(state))
    frame = _hand_frame(links)
    levers = frame[:, None, :3, 3] - links[:, :, :3, 3]
    beside = np.zeros((len(frame), 4, 4 + JOINTS))
    beside[:, :, :4] = frame
    for row in range(3):  # np.cross takes as long as all else here
        after, last = (row + 1) % 3, (row + 2) % 3
        moves = (
            links[:, :, after, 2] * levers[..., last] - links[:, :, last, 2] * levers[..., after]
        )
        beside[:, row, 4:] = moves * _MAX_STEP
    return beside


def _hand_frame(links: Array) -> Array:
    """The frame of the grasp point for those of the links, (n, 7, 4, 4) to (n, 4, 4)."""
    frame: Array = links[:, -1] @ _GRASP_FRAME
    return frame


def joint_contributions(hand: Array, displacements: Array) -> Array:
    """How far each joint at full speed takes the hand along some displacements, in STEP_SCALE.

    What it takes to go somewhere differs with the arm's configuration; a small network that
    observes joints and positions only would have to learn the arm's kinematics first.

    Args:
        hand: Frames and velocities of the hand, from :func:`hand_frame_and_velocities`.
        displacements: Displacements, m, shape (n, displacements, 3).

    Returns:
        Shape (n, displacements, joints).
    """
    lengths = np.sqrt(np.square(displacements).sum(axis=-1, keepdims=True))
    directions = displacements / np.maximum(lengths, DIRECTION_THRESHOLD)
    far: Array = directions @ hand[:, :3, 4:] / STEP_SCALE
    return far


def grasp_points(joints: Array) -> Array:
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
    height = (hand[:, 2, 3:4] - TABLE_TOP) / DISTANCE_SCALE
    axes = (hand[:, :3, 0], hand[:, :3, 2])
    return np.concatenate(
        [joints, *axes, height, held, held * offset / GRASP_OFFSET_SCALE], axis=-1
    )


def joint_limit_penalty(state: State) -> Array:
    """How far joints are beyond COMFORTABLE_RANGE, squared, 1 for each at its limit: shape (n,)."""
    beyond = np.maximum(np.abs(_over_ranges(state)) - COMFORTABLE_RANGE, 0.0) / (
        1.0 - COMFORTABLE_RANGE
    )
    summed: Array = np.square(beyond).sum(axis=-1)
    return summed


def scaled_displacements(state: State, hand: Array, column: Column) -> Array:
    """Displacements from the hand to objects, divided by DISTANCE_SCALE.

    Args:
        state: A batch of n states.
        hand: Frames of the hand, from :func:`hand_frame`, maybe with more columns.
        column: Objects whose displacements are wanted.

    Returns:
        Along the base's axes, shape (n, objects, 3).
    """
    scaled: Array = displacements(state, hand, column) / DISTANCE_SCALE
    return scaled


def scaled_velocities(state: State, column: Column) -> Array:
    """Velocities of bodies divided by SPEED_SCALE, clipped to 3, shape (n, objects, 3)."""
    return np.clip(state.gather(column, VELOCITY) / SPEED_SCALE, -3, 3)


Features = Callable[[State, Array, Column], Array]  # of objects, as LearnerInterface.objects


def joined(*parts: Features) -> Features:
    """Several features of objects as one."""

    def features(state: State, hand: Array, column: Column) -> Array:
        return np.concatenate([part(state, hand, column) for part in parts], axis=-1)

    return features


def speeds(state: State, _: Array, column: Column) -> Array:
    """How fast bodies are; see :func:`scaled_velocities`."""
    return scaled_velocities(state, column)


def square_turns(state: State, _: Array, column: Column) -> Array:
    """Which way squares are turned, which look the same four times, shape (n, objects, 2)."""
    turn = state.gather(column, ("qz", "qw"))
    yaw = 8.0 * np.arctan2(turn[..., 0], turn[..., 1])
    return np.stack([np.sin(yaw), np.cos(yaw)], axis=-1)


def no_features(state: State, column: Column) -> Array:
    """No features, shape (n, objects, 0): of the robot, which is observed already."""
    return np.zeros((*state.data.shape[:-1], len(column.objects), 0))


def unreachable(state: State, column: Column) -> Array:
    """Infinite distances to what there is no point in going to, shape (n, objects)."""
    return np.full((*state.data.shape[:-1], len(column.objects)), np.inf)


def distances_above(state: State, hand: Array, column: Column, height: float) -> Array:
    """Distances from the hand to points above the middles of objects.

    Args:
        state: A batch of n states.
        hand: Frames of the hand, from :func:`hand_frame`, maybe with more columns.
        column: Objects whose distances are wanted.
        height: Height of the points above the middles, m.

    Returns:
        m, shape (n, objects).
    """
    above = displacements_above(state, hand, column, height)
    distances: Array = np.sqrt(np.square(above).sum(axis=-1))
    return distances


def displacements_above(state: State, hand: Array, column: Column, height: float) -> Array:
    """Displacements from the hand to points above the middles of objects.

    Args:
        state: A batch of n states.
        hand: Frames of the hand, from :func:`hand_frame`, maybe with more columns.
        column: Objects whose displacements are wanted.
        height: Height of the points above the middles, m.

    Returns:
        Along the base's axes, m, shape (n, objects, 3).
    """
    above: Array = displacements(state, hand, column) + np.array([0.0, 0.0, height])
    return above


def displacements(state: State, hand: Array, column: Column) -> Array:
    """Displacements from the hand to the middles of objects.

    Args:
        state: A batch of n states.
        hand: Frames of the hand, from :func:`hand_frame`, maybe with more columns.
        column: Objects whose displacements are wanted.

    Returns:
        Along the base's axes, m, shape (n, objects, 3).
    """
    seen: Array = state.gather(column, POSITION) - hand[:, None, :3, 3]
    return seen


def separations(state: State, thing: Object, column: Column) -> Array:
    """Distances from the middle of a thing, or from the robot's hand, to the middles of objects.

    Args:
        state: A batch of n states.
        thing: Object that distances are measured from; a robot's are measured from its hand.
        column: Objects that distances are measured to.

    Returns:
        m, shape (n, objects).
    """
    if thing.type.is_a(ROBOT):
        return distances_above(state, hand_frame(state), column, 0.0)
    between = state.gather(column, POSITION) - state.gather(Column.of(thing), POSITION)
    distances: Array = np.sqrt(np.square(between).sum(axis=-1))
    return distances


def at_rest(state: State) -> Bools:
    """Whether no body moves any more, shape (n,)."""
    twists = np.abs(state.gather(bodies(state.layout), TWIST))
    still: Bools = twists.max(axis=(-2, -1)) < REST_SPEED
    return still


def fallen_below(height: float) -> Callable[[State], Bools]:
    """Whether a body's middle is lower than so many m, as it is once it fell: shape (n,)."""

    def failed(state: State) -> Bools:
        fallen: Bools = state.stack(bodies(state.layout), "z").min(axis=-1) < height
        return fallen

    return failed


def _joints(state: State) -> Array:
    joints: Array = state.gather(state.layout.column_of(ROBOT), JOINT_NAMES)[:, 0]
    return joints


def _over_ranges(state: State) -> Array:
    """Joints over their ranges, from -1 to 1, shape (n, 7)."""
    joints: Array = (_joints(state) - _MIDDLE) / _HALF_RANGE
    return joints
