# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D as a learner observes it. Lengths in m, divided by a block's size or the reach."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from slap_ros.core import LearnerInterface, SettingValue
from slap_ros.domains.obstacle2d.model import (
    BLOCK,
    BLOCK_SIZE,
    GRIPPER_EMPTY,
    HOLDING,
    ROBOT,
    SURFACE,
)
from slap_ros.relational import Column, Object, State
from slap_ros.relational.state import Array


def _hand(state: State) -> Array:
    """The gripper's x and y, and the height of the lowest of it and what it carries, (n, 3)."""
    robot, blocks = state.layout.column_of(ROBOT), state.layout.column_of(BLOCK)
    place = state.gather(robot, ("x", "y"))[..., 0, :]
    held = state.stack(blocks, "held") > 0.5
    carried = np.where(held, state.stack(blocks, "y"), np.inf).min(axis=-1)
    low = np.minimum(place[..., 1], carried)
    return np.concatenate([place, low[..., None]], axis=-1)


def _robot(_: State, hand: Array) -> Array:
    """Where it is in the unit square, how far down what it carries reaches, how low it is."""
    x, y, low = np.moveaxis(hand, -1, 0)
    return _side_by_side([2 * x - 1, 2 * y - 1, (y - low) / BLOCK_SIZE, low / BLOCK_SIZE])


def _object_features(state: State, hand: Array, column: Column) -> Array:
    """Where on the table, how far aside of the gripper; blocks: how far below, whether held."""
    x, y = hand[..., 0, None], hand[..., 1, None]
    there = state.stack(column, "x")
    features = [2 * there - 1, (there - x) / (2 * BLOCK_SIZE)]
    if column.objects[0].type.is_a(BLOCK):
        features += [(state.stack(column, "y") - y) / (2 * BLOCK_SIZE)]
        features += [state.stack(column, "held")]
    return _side_by_side(features)


def _side_by_side(features: Sequence[Array]) -> Array:
    """The features along a last axis, as ``np.stack`` has them in twice the time."""
    together = np.empty((*features[0].shape, len(features)))
    for i, feature in enumerate(features):
        together[..., i] = feature
    return together


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the gripper to the middle of blocks, m."""
    if not column.objects[0].type.is_a(BLOCK):
        return np.full((*state.data.shape[:-1], len(column.objects)), np.inf)
    aside = state.stack(column, "x") - hand[..., 0, None]
    below = state.stack(column, "y") - hand[..., 1, None]
    distance: Array = np.hypot(aside, below)
    return distance


def _separation(state: State, thing: Object, column: Column) -> Array:
    """Between middles; fixed places lie on the table, at y = 0."""
    aside = np.abs(state.stack(column, "x") - state.stack(Column.of(thing), "x"))
    height = 0.0 if thing.type.is_a(SURFACE) else state.stack(Column.of(thing), "y")
    separation: Array = np.hypot(aside, state.stack(column, "y") - height)
    return separation


LEARNER_INTERFACE = LearnerInterface(
    hand=_hand,
    robot=_robot,
    objects=_object_features,
    distance=_distance,
    separation=_separation,
    grasping=frozenset({HOLDING, GRIPPER_EMPTY}),
)


def _gripper(state: State) -> Array:
    """As the hand, but with the gripper's own height, whatever it carries."""
    place = state.gather(state.layout.column_of(ROBOT), ("x", "y"))[..., 0, :]
    return np.concatenate([place, place[..., 1:]], axis=-1)


def _relative_features(state: State, hand: Array, column: Column) -> Array:
    """The same as above without the place on the table, which is the same for every hand."""
    return _object_features(state, hand, column)[..., 1:]


# Without one of the terms above; see docs/by-hand.md.
ABLATIONS: Mapping[str, LearnerInterface] = {
    "reach of what is carried": replace(LEARNER_INTERFACE, hand=_gripper),
    "place on the table": replace(LEARNER_INTERFACE, objects=_relative_features),
    "all of them (plain)": replace(LEARNER_INTERFACE, hand=_gripper, objects=_relative_features),
}
# Where a training in this domain differs; see `slap train --settings`.
TRAINING_SETTINGS: Mapping[str, Mapping[str, SettingValue]] = {
    "ours": {
        # Its worlds are stepped together, so that many cost little.
        "exploration.tasks": 6,
        "exploration.rollouts": 6000,
        "exploration.length": 16,
        "exploration.action_repeat": 4,
        "ppo.n_envs": 128,
        "ppo.n_steps": 32,
        "ppo.batch_size": 512,
        "ppo.total_steps": 400_000,
        "polish": None,
        "horizon": 30,
    },
    # As its library was trained: a chain serves some tasks, and saves little over fewer.
    "ours_kept_chains": {"least_saving": 0.005, "validation": 48, "shortcuts": 8},
    "paper": {
        "exploration.rollouts": 1000,
        "exploration.length": 100,
        "exploration.hits": 1,
        "ppo.n_steps": 50,
        "ppo.total_steps": 50_000,
        "rewards.step": -0.5,
        "rewards.success": 10.0,
        "horizon": 50,
        "sampling.horizon": 50,
    },
}
