# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees: needed for shortcuts, not for planning. Lengths in m."""

from __future__ import annotations

import numpy as np

from marbles.model import HAND_EMPTY, HOLDING, ROBOT
from slap_ros.core import LearnerInterface
from slap_ros.relational import Column, Object, State
from slap_ros.relational.state import Array

SCALE = 0.3  # of observed distances
BEHIND = 0.02  # where the hand has to be to push a marble to the right


def _hand(state: State) -> Array:
    hand: Array = state.gather(state.layout.column_of(ROBOT), ("x", "y", "z"))[:, 0]
    return hand


def _robot(_: State, hand: Array) -> Array:
    return (hand - [0.5, 0.5, 0.1]) / [SCALE, SCALE, 0.1]


def _object_features(state: State, hand: Array, column: Column) -> Array:
    if column.objects[0].type == ROBOT:
        return np.zeros((len(hand), len(column.objects), 0))
    place = state.gather(column, ("x", "y"))
    held = state.gather(column, ("held",))
    return np.concatenate([(place - hand[:, None, :2]) / SCALE, place, held], axis=-1)


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the hand to just left of a marble, down on the tray."""
    if column.objects[0].type == ROBOT:
        return np.full((len(hand), len(column.objects)), np.inf)
    way = state.gather(column, ("x", "y")) - [BEHIND, 0.0] - hand[:, None, :2]
    distance: Array = np.hypot(np.hypot(way[..., 0], way[..., 1]), hand[:, None, 2])
    return distance


def _separation(state: State, thing: Object, column: Column) -> Array:
    way = state.gather(column, ("x", "y")) - state.gather(Column((thing,)), ("x", "y"))
    apart: Array = np.hypot(way[..., 0], way[..., 1])
    return apart


LEARNER_INTERFACE = LearnerInterface(
    hand=_hand,
    robot=_robot,
    objects=_object_features,
    distance=_distance,
    separation=_separation,
    grasping=frozenset({HOLDING, HAND_EMPTY}),
)
