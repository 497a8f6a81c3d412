# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What learners observe at a bench: the hand, and everything else relative to it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slap_ros.core import LearnerInterface
from slap_ros.domains.benchtop.cabinet import CABINET, HANDLE, MIDDLE
from slap_ros.domains.benchtop.drawers import in_drawers
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
from slap_ros.relational import Column, GroundAtom, Object, Predicate, State, Type
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import LEASH
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.contact.way_up import way_up_is_free
from slap_ros.worlds.panda import FINGER_OPEN

HEIGHT_SCALE = 0.2  # m, the scale of what is observed of the hand's height
FINE = 0.01  # m: below, what is observed of a distance is linear in it; above, its logarithm
SIZE_SCALE = 0.05  # m
SPEED_SCALE = 0.5  # m/s
OPENING_SCALE = {"m": 0.1, "rad": 1.0}
FALLEN = -0.05  # m, the height of what fell off the table
LENGTH_M = 0.05  # the scale of distances and margins
# By which share of a threshold a learned skill goes past it: the hand moves a drawer as it goes
# away, and what is done next moves what lies on or in something.
PLAY = {"IsCabinetOpen": 0.3, "IsCabinetClose": 0.5, "On": 0.1, "InCabinet": 0.3}
FINGERS = ("left_finger", "right_finger")
OF_ALL = {feature.name for kind in (THING, DRAWER, LID) for feature in kind.features}


def learner_interface(
    held: Predicate, scene_of: Callable[[State], ContactScene]
) -> LearnerInterface:
    """What learners observe in a domain.

    Args:
        held: Predicate Holding of the domain.
        scene_of: Function from a state to its bodies.
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
        success_tolerance=_success_tolerance,
        can_leave=lambda states: _can_leave(states, scene_of),
        length_m=LENGTH_M,
        frames=_frames,
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
        hand[..., 2:] / HEIGHT_SCALE,
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
        np.arcsinh((grips(state, column) - hand[..., None, :]) / FINE),
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


def grips(state: State, column: Column) -> Array:
    """Where the hand acts on objects, m, shape (..., objects, 3): on a drawer, at its handle."""
    drawer = column.objects[0].type.is_a(CABINET)
    return in_drawers(state, column, HANDLE) if drawer else positions(state, column)


def _frames(state: State, column: Column) -> tuple[Array, Array]:
    """Where things go, and how objects are turned: of a drawer, the middle of its floor."""
    drawer = column.objects[0].type.is_a(CABINET)
    origins = in_drawers(state, column, MIDDLE) if drawer else positions(state, column)
    return origins, state.gather(column, QUATERNION)


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
    between = state.gather(column, POSITION) - state.gather(Column.of(obj), POSITION)
    distances: Array = np.linalg.norm(between, axis=-1)
    return distances


def _all_at_rest(state: State) -> Bools:
    """Whether nothing moves by itself: what is held moves with the hand, wherever that goes."""
    things = state.layout.column_of(THING)
    speeds = np.linalg.norm(state.gather(things, LINEAR), axis=-1)
    spins = np.linalg.norm(state.gather(things, ANGULAR), axis=-1)
    held = state.gather(things, ("held",))[..., 0] > 0.5
    still: Bools = (held | ((speeds <= REST_SPEED) & (spins <= REST_SPIN))).all(axis=-1)
    return still


def _fallen(state: State) -> Bools:
    fallen: Bools = state.stack(state.layout.column_of(THING), "z").min(axis=-1) < FALLEN
    return fallen


def _success_tolerance(atom: GroundAtom) -> float:
    return PLAY.get(atom.predicate.name, 0.0)


def _can_leave(states: State, scene_of: Callable[[State], ContactScene]) -> Bools:
    return np.array([_can_go_up(State(states.layout, row), scene_of) for row in states.data])


def _can_go_up(state: State, scene_of: Callable[[State], ContactScene]) -> bool:
    scene = scene_of(state)
    index = ContactIndex.of(scene, state.layout)
    return way_up_is_free(scene, index.read(state), index.placement(scene, state))
