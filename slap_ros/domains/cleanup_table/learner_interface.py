# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table as a learner observes it: joints, and everything else from the hand and the bin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slap_ros.core import LearnerInterface, SettingValue
from slap_ros.core.learner_interface import no_penalty
from slap_ros.domains.cleanup_table.features import BLOCK, HALF, CleanupObjectIndex
from slap_ros.domains.cleanup_table.predicates import GRIPPER_EMPTY, HOLDING, NOT_HOLDING
from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.observation import Features, joined
from slap_ros.relational import Column, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

FALLEN = 0.05  # m, under the bin's rim, where what is not in the bin is beside it
BEHIND = 0.05  # m, from a block away from the bin, where the hand, or what it holds, pushes it


def _object_features(blocks: Features) -> Features:
    """Of blocks alone: the robot is observed already, the rest stands still."""

    def features(state: State, hand: Array, column: Column) -> Array:
        if not column.objects[0].type.is_a(BLOCK):
            return observation.no_features(state, column)
        return blocks(state, hand, column)

    return features


def _place_from_bin(state: State, _: Array, column: Column) -> Array:
    return _from_bin(state, column) / observation.DISTANCE_SCALE


def _from_bin(state: State, column: Column) -> Array:
    """From the middle of the bin, m, shape (n, objects, 2)."""
    seen: Array = state.gather(column, ("x", "y")) - state.gather(_bin(state), ("x", "y"))
    return seen


def _bin(state: State) -> Column:
    """The bin, alone; it stays one, so that one state of a batch tells."""
    surfaces = CleanupObjectIndex.of(state.layout).surfaces
    first = state.data.reshape(-1, state.data.shape[-1])[0]
    labels = first[state.layout.grid(surfaces, ("is_drawer",))[:, 0]]
    return Column.of(surfaces.objects[int(np.argmax(labels))])


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the hand to where it pushes blocks towards the bin: across it, any place will do."""
    if not column.objects[0].type.is_a(BLOCK):
        return observation.unreachable(state, column)
    way = observation.displacements(state, hand, column)
    way[..., 1] += BEHIND * np.sign(_from_bin(state, column)[..., 1])
    distance: Array = np.sqrt(np.square(way).sum(axis=-1))
    return distance


def _distance_to_middle(state: State, hand: Array, column: Column) -> Array:
    """From the hand to the middle of each block."""
    if not column.objects[0].type.is_a(BLOCK):
        return observation.unreachable(state, column)
    return observation.distances_above(state, hand, column, 0.0)


def _failed(state: State) -> Bools:
    """Whether a block lies on the floor beside the bin."""
    things = CleanupObjectIndex.of(state.layout)
    box = state.gather(_bin(state), ("z", *HALF))[..., 0, :]
    low = state.stack(things.blocks, "z") < (box[..., 0] + box[..., 3] - FALLEN)[..., None]
    off: Bools = np.abs(_from_bin(state, things.blocks)) > box[..., None, 1:3]
    lost: Bools = np.logical_or.reduce(low[..., None] & off, axis=(-2, -1))
    return lost


# In the order in which policies that ship observe them.
PLACE, SPEED = observation.scaled_displacements, observation.speeds
LEARNER_INTERFACE = LearnerInterface(
    hand=observation.hand_frame,
    robot=observation.robot,
    objects=_object_features(joined(PLACE, SPEED, _place_from_bin)),
    distance=_distance,
    separation=observation.separations,
    at_rest=observation.at_rest,
    failed=_failed,
    joint_limit_penalty=observation.joint_limit_penalty,
    grasping=frozenset({HOLDING, NOT_HOLDING, GRIPPER_EMPTY}),
)
# Without one of the terms above; see docs/by-hand.md.
ABLATIONS: Mapping[str, LearnerInterface] = {
    "place from the bin": replace(
        LEARNER_INTERFACE, objects=_object_features(joined(PLACE, SPEED))
    ),
    "hand behind toys": replace(LEARNER_INTERFACE, distance=_distance_to_middle),
    "joint limits": replace(LEARNER_INTERFACE, joint_limit_penalty=no_penalty),
    "all of them (plain)": replace(
        LEARNER_INTERFACE,
        objects=_object_features(joined(PLACE, SPEED)),
        distance=_distance_to_middle,
        joint_limit_penalty=no_penalty,
    ),
}
# Where a training in this domain differs; see `slap train --settings`.
TRAINING_SETTINGS: Mapping[str, Mapping[str, SettingValue]] = {
    "ours": {
        # Nodes: everything over which the hand can be, that it can grasp, and lift.
        "exploration.tasks": 3,
        "exploration.rollouts": 32,
        "exploration.length": 40,
        "exploration.nodes": 13,
        "ppo.total_steps": 120_000,
        "polish.total_steps": 200_000,
        "horizon": 40,
        "starts": 200,
        "shortcuts": 2,
        # The arm holds the wiper in one of two configurations; some attempts learn one alone.
        "attempts": 3,
    },
    "ours_kept_chains": {"starts": 200},  # the sweep is tried out in each, which takes its time
}
