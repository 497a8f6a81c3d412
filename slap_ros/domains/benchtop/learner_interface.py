# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What learners observe at a bench: the hand, and everything else relative to it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from slap_ros.contact.features import ROBOT
from slap_ros.contact.hand import LEASH
from slap_ros.core import LearnerInterface
from slap_ros.domains.benchtop.features import DRAWER, LID, REST_HEIGHT, THING
from slap_ros.domains.benchtop.metrics import REST_SPEED, REST_SPIN
from slap_ros.domains.benchtop.state_access import (
    ANGULAR,
    LINEAR,
    POSITION,
    QUATERNION,
    TARGET,
    hand_positions,
    positions,
)
from slap_ros.physics.panda import FINGER_OPEN
from slap_ros.relational import Column, Object, Predicate, State, Type
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

DISTANCE_SCALE = 0.2  # m, the scale of what is observed
SIZE_SCALE = 0.05  # m
SPEED_SCALE = 0.5  # m/s
OPENING_SCALE = {"m": 0.1, "rad": 1.0}
FALLEN = -0.05  # m, the height of what fell off the table
LENGTH_M = 0.05  # the scale of distances and margins
FINGERS = ("left_finger", "right_finger")
OF_ALL = {feature.name for kind in (THING, DRAWER, LID) for feature in kind.features}


def learner_interface(held: Predicate) -> LearnerInterface:
    """What is observed in a domain.

    Args:
        held: Its predicate Holding.
    """
    return LearnerInterface(
        hand=lambda state: hand_positions(state)[..., 0, :],
        robot=_robot,
        objects=_object_features,
        distance=_distances,
        separation=_separations,
        at_rest=_all_at_rest,
        failed=_fallen,
        grasping=frozenset({held}),
        length_m=LENGTH_M,
    )


def _robot(state: State, hand: Array) -> Array:
    """Fingers, gripper, turn, height, speed, and how far the hand lags behind its target."""
    robot = state.layout.column_of(ROBOT)
    qx, qy, _, _ = np.moveaxis(state.gather(robot, QUATERNION)[..., 0, :], -1, 0)
    yaw = 2.0 * np.arctan2(qy, qx)
    lag = state.gather(robot, TARGET)[..., 0, :] - hand
    parts = [
        state.gather(robot, FINGERS)[..., 0, :] / FINGER_OPEN,
        state.stack(robot, "gripper"),
        np.stack([np.sin(yaw), np.cos(yaw)], axis=-1),
        hand[..., 2:] / DISTANCE_SCALE,
        state.gather(robot, LINEAR)[..., 0, :] / SPEED_SCALE,
        lag / LEASH,
    ]
    return np.concatenate(parts, axis=-1)


def _object_features(state: State, hand: Array, column: Column) -> Array:
    """Where from the hand, how turned, which sizes; of things how fast; of joints how far open."""
    kind = column.objects[0].type
    if kind.is_a(ROBOT):
        return np.zeros((*state.data.shape[:-1], len(column.objects), 0))
    parts = [
        (positions(state, column) - hand[..., None, :]) / DISTANCE_SCALE,
        state.gather(column, QUATERNION),
    ]
    if kind.is_a(THING):
        parts.append(np.clip(state.gather(column, LINEAR) / SPEED_SCALE, -3.0, 3.0))
        parts.append(state.gather(column, ("held",)))
    if "opening" in kind.column:
        scale = OPENING_SCALE[kind.features[kind.column["opening"]].unit]
        parts.append(state.gather(column, ("opening",)) / scale)
    if sizes := _sizes(kind):
        parts.append(state.gather(column, sizes) / SIZE_SCALE)
    return np.concatenate(parts, axis=-1)


def _sizes(kind: Type) -> tuple[str, ...]:
    """What tells things of one type apart: the sizes that it alone has, and how high they stand."""
    own = tuple(feature.name for feature in kind.features if feature.name not in OF_ALL)
    return (REST_HEIGHT.name, *own) if own and kind.is_a(THING) else own


def _distances(state: State, hand: Array, column: Column) -> Array:
    if column.objects[0].type.is_a(ROBOT):
        return np.full((*state.data.shape[:-1], len(column.objects)), np.inf)
    distances: Array = np.linalg.norm(positions(state, column) - hand[..., None, :], axis=-1)
    return distances


def _separations(state: State, obj: Object, column: Column) -> Array:
    """Between origins; a robot's is its grasp point."""
    between = state.gather(column, POSITION) - state.gather(_alone(obj), POSITION)
    distances: Array = np.linalg.norm(between, axis=-1)
    return distances


def _all_at_rest(state: State) -> Bools:
    things = state.layout.column_of(THING)
    speeds = np.linalg.norm(state.gather(things, LINEAR), axis=-1).max(axis=-1)
    spins = np.linalg.norm(state.gather(things, ANGULAR), axis=-1).max(axis=-1)
    still: Bools = (speeds <= REST_SPEED) & (spins <= REST_SPIN)
    return still


def _fallen(state: State) -> Bools:
    fallen: Bools = state.stack(state.layout.column_of(THING), "z").min(axis=-1) < FALLEN
    return fallen


@lru_cache(maxsize=256)
def _alone(obj: Object) -> Column:
    return Column((obj,))
