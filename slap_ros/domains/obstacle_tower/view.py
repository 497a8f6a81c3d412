# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower as a learner sees it: joints, and everything else from the hand."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from slap_ros.domains.obstacle_tower.model import (
    BLOCK,
    GRIPPER_EMPTY,
    HOLDING,
    NOT_HOLDING,
    SURFACE,
)
from slap_ros.domains.view import View
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, arm_frames, matrix
from slap_ros.physics.features import GRASP_FEATURES, JOINT_FEATURES, ROBOT
from slap_ros.physics.panda import GRASP_POINT, JOINT_HIGH, JOINT_LOW
from slap_ros.physics.scene import CUBE_EDGE, TABLE_TOP
from slap_ros.relational import Column, Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

FAR = 0.2  # m, the scale of what is seen
NEAR = 0.1  # m, the scale of what is beside the target
FAST = 0.5  # m/s
STILL = 0.05  # m/s and rad/s, along each axis: a block so slow stays where it is
FALLEN = TABLE_TOP - 0.05  # m, below which a block's centre is off the table
FINGER_ROOM = 0.02  # m, between the target and what lies beside it, to put a block down there

JOINTS = tuple(feature.name for feature in JOINT_FEATURES)
GRASP_POSITION = tuple(feature.name for feature in GRASP_FEATURES[:3])
POSITION = ("x", "y", "z")
VELOCITY = ("vx", "vy", "vz")
TWIST = (*VELOCITY, "wx", "wy", "wz")
_MIDDLE = (np.array(JOINT_HIGH) + JOINT_LOW) / 2
_HALF_RANGE = (np.array(JOINT_HIGH) - JOINT_LOW) / 2
_GRASP_FRAME = matrix(GRASP_IN_LAST_LINK)
_GRASP_OFFSET = np.array([0.0, 0.0, GRASP_POINT])
BESIDE, OVER = CUBE_EDGE / 2, CUBE_EDGE  # m, of the hand over a block's middle and a target's
OFF_CENTRE = 0.02  # m, the scale of where in the fingers a block is held


def _joints(state: State) -> Array:
    joints: Array = state.gather(state.layout.column_of(ROBOT), JOINTS)[:, 0]
    return joints


def _hand(state: State) -> Array:
    """Frame of the point between the fingertips, shape (n, 4, 4)."""
    hand: Array = arm_frames(_joints(state))[:, -1] @ _GRASP_FRAME
    return hand


def _robot(state: State, hand: Array) -> Array:
    """Joints over their ranges; hand: x and z axes, height; what it holds, from the hand."""
    layout = state.layout
    held = state.stack(layout.column_of(BLOCK), "held").max(axis=-1, keepdims=True)
    offset = state.gather(layout.column_of(ROBOT), GRASP_POSITION)[:, 0] - _GRASP_OFFSET
    joints = (_joints(state) - _MIDDLE) / _HALF_RANGE
    height = (hand[:, 2, 3:] - TABLE_TOP) / FAR
    axes = (hand[:, :3, 0], hand[:, :3, 2])
    return np.concatenate([joints, *axes, height, held, held * offset / OFF_CENTRE], axis=-1)


def _things(state: State, hand: Array, column: Column) -> Array:
    """Where from the hand, in the base's axes.

    Of blocks also: how fast, and where over the target. Of what is fixed: which way it is turned.
    """
    if column.objects[0].type.is_a(ROBOT):
        return np.zeros((*state.data.shape[:-1], len(column.objects), 0))  # it is seen already
    place = _from(hand, state, column) / FAR
    if column.objects[0].type.is_a(BLOCK):
        speed = np.clip(state.gather(column, VELOCITY) / FAST, -3, 3)
        return np.concatenate([place, speed, _over_target(state, column) / NEAR], axis=-1)
    turn = state.gather(column, ("qz", "qw"))
    yaw = 8.0 * np.arctan2(turn[..., 0], turn[..., 1])  # a square looks the same four times
    return np.concatenate([place, np.sin(yaw)[..., None], np.cos(yaw)[..., None]], axis=-1)


def _over_target(state: State, column: Column) -> Array:
    """Positions in the plane along the axes of the target, from its middle, m, (n, objects, 2)."""
    x, y, z, w = np.moveaxis(state.gather(_target(state), ("x", "y", "qz", "qw")), -1, 0)
    sin, cos = 2.0 * z * w, w * w - z * z
    seen = state.gather(column, ("x", "y"))
    dx, dy = seen[..., 0] - x, seen[..., 1] - y
    return np.stack([cos * dx + sin * dy, cos * dy - sin * dx], axis=-1)


def _target(state: State) -> Column:
    """The target, alone; targets stay targets, so that one state of a batch tells."""
    surfaces = state.layout.column_of(SURFACE)
    first = state.data.reshape(-1, state.data.shape[-1])[0]
    labels = first[state.layout.grid(surfaces, ("is_target",))[:, 0]]
    return _alone(surfaces.objects[int(np.argmax(labels))])


@lru_cache(maxsize=256)
def _alone(obj: Object) -> Column:
    return Column((obj,))


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the hand to blocks and targets: so high that the table is not in the way.

    Who is where a block should not be keeps it from coming to lie there.
    """
    thing = column.objects[0].type
    if thing.is_a(ROBOT):
        return np.full((*state.data.shape[:-1], len(column.objects)), np.inf)
    height = BESIDE if thing.is_a(BLOCK) else OVER
    way = _from(hand, state, column) + np.array([0.0, 0.0, height])
    distance: Array = np.sqrt(np.square(way).sum(axis=-1))
    if thing.is_a(BLOCK):
        return distance
    return np.where(state.stack(column, "is_target") > 0.5, distance, np.inf)


def _apart(state: State, thing: Object, column: Column) -> Array:
    """From middle to middle."""
    way = state.gather(column, POSITION) - state.gather(_alone(thing), POSITION)
    apart: Array = np.sqrt(np.square(way).sum(axis=-1))
    return apart


def _from(hand: Array, state: State, column: Column) -> Array:
    """Positions less that of the hand, m, shape (n, objects, 3)."""
    seen: Array = state.gather(column, POSITION) - hand[:, None, :3, 3]
    return seen


def _settled(state: State) -> Bools:
    twists = np.abs(state.gather(state.layout.column_of(BLOCK), TWIST))
    settled: Bools = twists.max(axis=(-2, -1)) < STILL
    return settled


def _lost(state: State) -> Bools:
    lost: Bools = state.stack(state.layout.column_of(BLOCK), "z").min(axis=-1) < FALLEN
    return lost


VIEW = View(
    hand=_hand,
    robot=_robot,
    things=_things,
    distance=_distance,
    apart=_apart,
    settled=_settled,
    lost=_lost,
    slack={"NothingOn": FINGER_ROOM},
    grasping=frozenset({HOLDING, NOT_HOLDING, GRIPPER_EMPTY}),
)
