# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower as a learner observes it: joints, and everything else from the hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from slap_ros.core import LearnerInterface, SettingValue
from slap_ros.core.learner_interface import exactly, no_penalty
from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.domains.obstacle_tower.predicates import (
    GRIPPER_EMPTY,
    HOLDING,
    NOT_HOLDING,
    NOTHING_ON,
)
from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.observation import Features, joined
from slap_ros.relational import Column, GroundAtom, Object, State
from slap_ros.relational.predicates import cache_latest
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, TABLE_TOP

NEAR = 0.1  # m, the scale of what is beside the target
FALLEN = TABLE_TOP - 0.05  # m, below which a block's centre is off the table
FINGER_ROOM = 0.005  # m, between the target and what lies beside it: enough for two fingers
BESIDE, OVER = CUBE_EDGE / 2, CUBE_EDGE  # m, of the hand over a block's middle and a target's


def _object_features(blocks: Features, fixed: Features) -> Features:
    """Of blocks and of what is fixed; the robot is observed already."""

    def features(state: State, hand: Array, column: Column) -> Array:
        kind = column.objects[0].type
        if kind.is_a(ROBOT):
            return observation.no_features(state, column)
        return (blocks if kind.is_a(BLOCK) else fixed)(state, hand, column)

    return features


def _place_over_target(state: State, _: Array, column: Column) -> Array:
    return _over_target(state, column) / NEAR


def _joints_above(height: float) -> Features:
    """Which joints take the hand to so many m above things."""

    def features(state: State, hand: Array, column: Column) -> Array:
        above = observation.displacements_above(state, hand, column, height)
        return observation.joint_contributions(hand, above)

    return features


def _joints_off_target(state: State, hand: Array, column: Column) -> Array:
    """Which joints push blocks away from the nearest target."""
    off = _off_target(state, column)
    level = np.concatenate([off, np.zeros((*off.shape[:2], 1))], axis=-1)
    return observation.joint_contributions(hand, level)


def _off_target(state: State, column: Column) -> Array:
    """Positions in the plane from the middle of the nearest target, m, shape (n, objects, 2)."""
    return _of_nearest(_off_targets(state, column))[0]


def _over_target(state: State, column: Column) -> Array:
    """The same along the axes of that target."""
    off = _off_targets(state, column)
    turns = state.gather(_targets(state), ("qz", "qw"))[..., None, :, :]
    places, turned = _of_nearest(off, np.broadcast_to(turns, off.shape))
    dx, dy, z, w = places[..., 0], places[..., 1], turned[..., 0], turned[..., 1]
    sin, cos = 2.0 * z * w, w * w - z * z
    return np.stack([cos * dx + sin * dy, cos * dy - sin * dx], axis=-1)


def _off_targets(state: State, column: Column) -> Array:
    """Positions in the plane from the middles of targets, m, shape (n, objects, targets, 2)."""
    places = state.gather(column, ("x", "y"))[..., :, None, :]
    off: Array = places - state.gather(_targets(state), ("x", "y"))[..., None, :, :]
    return off


def _of_nearest(off: Array, *others: Array) -> list[Array]:
    """What holds of the nearest target: each (n, objects, targets, 2) to (n, objects, 2).

    Args:
        off: Positions from the middles of targets, m.
        others: What else is asked of that target.
    """
    if off.shape[-2] == 1:  # the only one is the nearest
        return [values[..., 0, :] for values in (off, *others)]
    nearest = np.argmin(np.square(off).sum(axis=-1), axis=-1)[..., None, None]
    return [np.take_along_axis(values, nearest, axis=-2)[..., 0, :] for values in (off, *others)]


@cache_latest
def _targets(state: State) -> Column:
    """The targets, or any surface where there is none; they stay so: one state of a batch tells."""
    surfaces = state.layout.column_of(SURFACE)
    first = state.data.reshape(-1, state.data.shape[-1])[0]
    labels = first[state.layout.grid(surfaces, ("is_target",))[:, 0]] > 0.5
    targets = tuple(obj for obj, label in zip(surfaces.objects, labels, strict=True) if label)
    return _column(targets or surfaces.objects[:1])


@lru_cache(maxsize=256)
def _column(objects: tuple[Object, ...]) -> Column:
    """The same column for the same objects, as columns keep their indices."""
    return Column(objects)


def _distances(beside: float, over: float) -> Features:
    """From the hand to so many m above blocks and targets, where the table is not in the way.

    A hand that is where a block should go keeps the block from coming to lie there.
    """

    def distances(state: State, hand: Array, column: Column) -> Array:
        thing = column.objects[0].type
        if thing.is_a(ROBOT):
            return observation.unreachable(state, column)
        if thing.is_a(BLOCK):
            return observation.distances_above(state, hand, column, beside)
        distance = observation.distances_above(state, hand, column, over)
        return np.where(state.stack(column, "is_target") > 0.5, distance, np.inf)

    return distances


def _success_tolerance(atom: GroundAtom) -> float:
    """Fingers need room around the target; blocks may lie as they like."""
    frees_target = atom.predicate == NOTHING_ON and atom.objects[0].type.is_a(SURFACE)
    return FINGER_ROOM if frees_target else 0.0


# In the order in which policies that ship observe them.
PLACE, SPEED, TURN = (
    observation.scaled_displacements,
    observation.speeds,
    observation.square_turns,
)
TO_BLOCKS, TO_TARGET = _joints_above(BESIDE), _joints_above(OVER)
LEARNER_INTERFACE = LearnerInterface(
    hand=observation.hand_frame_and_velocities,
    robot=observation.robot,
    objects=_object_features(
        joined(PLACE, SPEED, _place_over_target, TO_BLOCKS, _joints_off_target),
        joined(PLACE, TURN, TO_TARGET),
    ),
    distance=_distances(BESIDE, OVER),
    separation=observation.separations,
    at_rest=observation.at_rest,
    failed=observation.fallen_below(FALLEN),
    joint_limit_penalty=observation.joint_limit_penalty,
    success_tolerance=_success_tolerance,
    grasping=frozenset({HOLDING, NOT_HOLDING, GRIPPER_EMPTY}),
)
# Without one of the terms above; see docs/by-hand.md.
ABLATIONS: Mapping[str, LearnerInterface] = {
    "joints towards things": replace(
        LEARNER_INTERFACE,
        objects=_object_features(
            joined(PLACE, SPEED, _place_over_target, _joints_off_target), joined(PLACE, TURN)
        ),
    ),
    "joints that push off the target": replace(
        LEARNER_INTERFACE,
        objects=_object_features(
            joined(PLACE, SPEED, _place_over_target, TO_BLOCKS), joined(PLACE, TURN, TO_TARGET)
        ),
    ),
    "place over the target": replace(
        LEARNER_INTERFACE,
        objects=_object_features(
            joined(PLACE, SPEED, TO_BLOCKS, _joints_off_target), joined(PLACE, TURN, TO_TARGET)
        ),
    ),
    "heights above things": replace(LEARNER_INTERFACE, distance=_distances(0.0, 0.0)),
    "room for fingers": replace(LEARNER_INTERFACE, success_tolerance=exactly),
    "joint limits": replace(LEARNER_INTERFACE, joint_limit_penalty=no_penalty),
    "all of them (plain)": replace(
        LEARNER_INTERFACE,
        objects=_object_features(joined(PLACE, SPEED), joined(PLACE, TURN)),
        distance=_distances(0.0, 0.0),
        success_tolerance=exactly,
        joint_limit_penalty=no_penalty,
    ),
}
# Where a training in this domain differs; see `slap train --settings`.
TRAINING_SETTINGS: Mapping[str, Mapping[str, SettingValue]] = {
    "ours": {
        "ppo.n_envs": 32,
        "ppo.parts": 2,
        "ppo.batch_size": 512,
        "ppo.total_steps": 300_000,
        "polish.n_envs": 32,
        "polish.parts": 2,
        "polish.batch_size": 1024,
        "polish.total_steps": 1_500_000,
        "polish_rewards.failure": -30.0,
        "horizon": 50,
        "starts": 4000,
        "shortcuts": 1,  # all that is found is the slap, from the one or the other state
    },
    # With search in the model, plans are as short after the first stage as after the second.
    "ours_several": {"polish": None, "shortcuts": 4},
    "ours_kept_chains": {"starts": 1_000},  # a slap and a skill: each start has another tower
}
