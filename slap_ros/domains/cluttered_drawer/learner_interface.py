# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer as a learner observes it: joints, and everything else from the hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slap_ros.core import LearnerInterface, SettingValue
from slap_ros.core.learner_interface import exactly, no_penalty
from slap_ros.domains.cluttered_drawer.blocking import SIDES
from slap_ros.domains.cluttered_drawer.features import BLOCK, SURFACE, TARGET
from slap_ros.domains.cluttered_drawer.predicates import GRASPING
from slap_ros.domains.cluttered_drawer.scene import BOTTOM
from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.observation import Features, joined
from slap_ros.relational import Column, GroundAtom, State
from slap_ros.relational.state import Array

NEAR = 0.1  # m, the scale of what is beside the target block
AROUND = 0.01  # m, of the hand over the target block's middle: fingers halfway down beside it
CLEAR = frozenset(f"{side}Clear" for side in SIDES)
FINGER_ROOM = 0.002  # m, more than blocks nothing: so much the next grasp may be off


def _object_features(blocks: Features) -> Features:
    """Where from the hand, in the base's axes; more of blocks."""

    def features(state: State, hand: Array, column: Column) -> Array:
        kind = column.objects[0].type
        if kind.is_a(SURFACE):
            return observation.scaled_displacements(state, hand, column)
        if not kind.is_a(BLOCK):
            return observation.no_features(state, column)
        return blocks(state, hand, column)

    return features


def _place_beside_target(state: State, _: Array, column: Column) -> Array:
    return _beside_target(state, column) / NEAR


def _beside_target(state: State, column: Column) -> Array:
    """Positions less that of the target block, m, shape (n, objects, 2)."""
    beside: Array = state.gather(column, ("x", "y")) - state.gather(_target(state), ("x", "y"))
    return beside


def _distance(state: State, hand: Array, column: Column) -> Array:
    """From the hand to around the target block: from there its fingers push any of the blocks."""
    if not column.objects[0].type.is_a(BLOCK):
        return observation.unreachable(state, column)
    around = observation.distances_above(state, hand, _target(state), AROUND)
    return np.repeat(around, len(column.objects), axis=-1)


def _distance_to_middle(state: State, hand: Array, column: Column) -> Array:
    """From the hand to the middle of each block."""
    if not column.objects[0].type.is_a(BLOCK):
        return observation.unreachable(state, column)
    return observation.distances_above(state, hand, column, 0.0)


def _target(state: State) -> Column:
    return Column.of(state.layout.of_type(TARGET)[0])


def _success_tolerance(atom: GroundAtom) -> float:
    return FINGER_ROOM if atom.predicate.name in CLEAR else 0.0


# In the order in which policies that ship observe them.
PLACE, SPEED, TURN = (
    observation.scaled_displacements,
    observation.speeds,
    observation.square_turns,
)
LEARNER_INTERFACE = LearnerInterface(
    hand=observation.hand_frame,
    robot=observation.robot,
    objects=_object_features(joined(PLACE, SPEED, TURN, _place_beside_target)),
    distance=_distance,
    separation=observation.separations,
    at_rest=observation.at_rest,
    failed=observation.fallen_below(BOTTOM),
    joint_limit_penalty=observation.joint_limit_penalty,
    success_tolerance=_success_tolerance,
    grasping=GRASPING,
    length_m=0.05,
)
# Without one of the terms above; see docs/by-hand.md.
ABLATIONS: Mapping[str, LearnerInterface] = {
    "place beside the target block": replace(
        LEARNER_INTERFACE, objects=_object_features(joined(PLACE, SPEED, TURN))
    ),
    "hand around the target block": replace(LEARNER_INTERFACE, distance=_distance_to_middle),
    "room for fingers": replace(LEARNER_INTERFACE, success_tolerance=exactly),
    "joint limits": replace(LEARNER_INTERFACE, joint_limit_penalty=no_penalty),
    "all of them (plain)": replace(
        LEARNER_INTERFACE,
        objects=_object_features(joined(PLACE, SPEED, TURN)),
        distance=_distance_to_middle,
        success_tolerance=exactly,
        joint_limit_penalty=no_penalty,
    ),
}
# Where a training in this domain differs; see `slap train --settings`.
TRAINING_SETTINGS: Mapping[str, Mapping[str, SettingValue]] = {
    "ours": {"polish.total_steps": 200_000, "horizon": 50, "starts": 600},
}
