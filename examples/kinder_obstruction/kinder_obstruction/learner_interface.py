# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees: needed for shortcuts, not for planning. Lengths in m."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kinder_obstruction.environment import ACTIONS, CONFIG
from kinder_obstruction.model import (
    BLOCK,
    HAND_EMPTY,
    HOLDING,
    ROBOT,
    SURFACE,
    TABLE,
    TARGET,
    half_extents,
)
from slap_ros.core import LearnerInterface
from slap_ros.relational import Column, Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

# A shortcut moves base and gripper; the arm keeps its length and its direction.
LEARNED_AXES = np.array([1.0, 1.0, 0.0, 0.0, 1.0])
LEARNED_ACTIONS = replace(
    ACTIONS,
    low=tuple((LEARNED_AXES * ACTIONS.low).tolist()),
    high=tuple((LEARNED_AXES * ACTIONS.high).tolist()),
)
SCALE = 0.5  # of what is seen
AT_REST = 0.05  # m/s and rad/s
LYING = 0.3  # sine of a tilt from which a block falls over
TIP = CONFIG.gripper_finger_width
LOWEST = 0.3  # of a tip above the table, for pushing


def _tip(state: State) -> Array:
    """The middle between the fingertips, shape (n, 2)."""
    names = ("x", "y", "theta", "arm_joint")
    x, y, turn, arm = state.gather(state.layout.column_of(ROBOT), names)[:, 0].T
    tip: Array = np.stack([x + (arm + TIP) * np.cos(turn), y + (arm + TIP) * np.sin(turn)], -1)
    return tip


def _robot(state: State, hand: Array) -> Array:
    """The robot, and the target even where it plays no role: it must not be knocked over."""
    names = ("x", "y", "theta", "finger_gap")
    own = state.gather(state.layout.column_of(ROBOT), names)[:, 0]
    held = state.gather(state.layout.column_of(BLOCK), ("held",))[..., 0].max(axis=-1)
    middle = (CONFIG.world_min_x + CONFIG.world_max_x) / 2
    scaled = (own - [middle, 1.0, 0.0, 0.2]) / [1.0, SCALE, 1.5, 0.2]
    target = state.gather(state.layout.column_of(TARGET), ("x", "y", "height"))[:, 0]
    relative = (target - np.pad(hand, ((0, 0), (0, 1)))) / SCALE
    return np.concatenate([scaled, hand - [middle, SCALE], held[:, None], relative], -1)


def _objects(state: State, hand: Array, column: Column) -> Array:
    if column.objects[0].type == ROBOT:
        return np.zeros((len(hand), len(column.objects), 0))
    names = ("x", "y", "theta", "width", "height")
    seen = state.gather(column, names)
    relative = (seen[..., :2] - hand[:, None]) / SCALE
    shape = seen[..., 3:] / SCALE
    if column.objects[0].type.is_a(SURFACE):
        return np.concatenate([relative, shape], -1)
    held = state.gather(column, ("held",))
    return np.concatenate([relative, np.sin(seen[..., 2:3]), shape, held], -1)


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the fingertips to a block's side; there is nothing to do at the surface itself."""
    if not column.objects[0].type.is_a(BLOCK):
        return np.full((len(hand), len(column.objects)), np.inf)
    half_x, _ = half_extents(state, column)
    away = np.abs(state.gather(column, ("x",))[..., 0] - hand[:, None, 0])
    high = np.maximum(hand[:, None, 1] - TABLE - LOWEST, 0.0)
    distance: Array = np.hypot(np.maximum(away - half_x, 0.0), high)
    return distance


def _separation(state: State, thing: Object, column: Column) -> Array:
    apart: Array = np.abs(
        state.gather(column, ("x",))[..., 0] - state.gather(Column((thing,)), ("x",))[..., 0]
    )
    return apart


def _at_rest(state: State) -> Bools:
    blocks = state.layout.column_of(BLOCK)
    speed = np.abs(state.gather(blocks, ("vx", "vy", "omega"))).max(axis=-1)
    still: Bools = (speed < AT_REST) | (state.gather(blocks, ("held",))[..., 0] > 0.5)
    return still.all(axis=-1)


def _failed(state: State) -> Bools:
    """The target fell over: the hand cannot take it any more."""
    lying: Bools = np.abs(np.sin(state.gather(state.layout.column_of(TARGET), ("theta",)))) > LYING
    return lying[..., 0].any(axis=-1)


LEARNER_INTERFACE = LearnerInterface(
    hand=_tip,
    robot=_robot,
    objects=_objects,
    distance=_distance,
    separation=_separation,
    at_rest=_at_rest,
    failed=_failed,
    grasping=frozenset({HOLDING, HAND_EMPTY}),
)
