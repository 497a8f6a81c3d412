# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state as the world computes with it: plain floats, read from and written to the array."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import IDENTITY, ORIGIN, Pose, Vector
from slap_ros.relational import Feature, Layout, Object, State
from slap_ros.worlds.features import (
    BODY_FEATURES,
    GRASP_FEATURES,
    JOINT_FEATURES,
    MATERIAL_FEATURES,
    POSE_FEATURES,
    ROBOT,
)
from slap_ros.worlds.scene import Material, Scene


class BodyState(NamedTuple):
    """How a free body is and moves, in the base's frame."""

    pose: Pose
    velocity: Vector = ORIGIN  # m/s
    angular_velocity: Vector = ORIGIN  # rad/s

    @property
    def still(self) -> bool:
        """Whether it has no velocity at all."""
        return self.velocity == ORIGIN and self.angular_velocity == ORIGIN


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything physics knows of a state."""

    joints: tuple[float, ...]  # rad
    finger: float  # m
    grasp: Pose  # the held body in the hand's frame
    held: int | None  # index among the scene's free bodies
    bodies: tuple[BodyState, ...]  # the scene's free bodies

    def moved(self, index: int, motion: BodyState) -> Snapshot:
        """The same with one body elsewhere."""
        bodies = (*self.bodies[:index], motion, *self.bodies[index + 1 :])
        return replace(self, bodies=bodies)


@dataclass(frozen=True, eq=False)
class SnapshotCodec:
    """Where a scene's features lie in the states of a layout."""

    layout: Layout
    robot: NDArray[np.intp]  # (7 + 1 + 7,): joints, finger, grasp
    bodies: NDArray[np.intp]  # (free bodies, 14)
    fixed: tuple[NDArray[np.intp] | None, ...]  # a fixed body's pose, where the state has one
    material_columns: tuple[
        NDArray[np.intp] | None, ...
    ]  # a free body's material, where it has one

    @staticmethod
    @lru_cache(maxsize=256)
    def of(scene: Scene, layout: Layout) -> SnapshotCodec:
        """The reader for a scene and a layout.

        Raises:
            InvalidStateError: Not exactly one robot, or a free body that the state does not have.
        """
        robots = layout.of_type(ROBOT)
        if len(robots) != 1:
            raise InvalidStateError(f"a scene has one robot, the state has {len(robots)}")
        columns = (*JOINT_FEATURES, Feature("finger", "m"), *GRASP_FEATURES)
        free = [_embodied(layout, body.name) for body in scene.free]
        return SnapshotCodec(
            layout,
            _columns(layout, robots[0], columns),
            np.array([_columns(layout, obj, BODY_FEATURES) for obj in free], dtype=np.intp).reshape(
                -1, len(BODY_FEATURES)
            ),
            tuple(_optional(layout, body.name, POSE_FEATURES) for body in scene.fixed),
            tuple(_optional(layout, body.name, MATERIAL_FEATURES) for body in scene.free),
        )

    def read(self, state: State) -> Snapshot:
        """The state's physics.

        Raises:
            InvalidStateError: Two bodies are held.
        """
        *joints, finger, x, y, z, qx, qy, qz, qw = state.data[self.robot].tolist()
        rows: list[list[float]] = state.data[self.bodies].tolist()
        held = [i for i, row in enumerate(rows) if row[-1] > 0.5]
        if len(held) > 1:
            raise InvalidStateError(f"the gripper holds one body at most, here {len(held)}")
        return Snapshot(
            tuple(joints),
            finger,
            Pose((x, y, z), (qx, qy, qz, qw)) if held else IDENTITY,
            held[0] if held else None,
            tuple(_motion(row) for row in rows),
        )

    def write(self, state: State, snapshot: Snapshot) -> State:
        """The state with its physics replaced."""
        data = state.data.copy()
        grasp = snapshot.grasp
        data[self.robot] = (
            *snapshot.joints,
            snapshot.finger,
            *grasp.position,
            *grasp.quaternion,
        )
        if snapshot.bodies:
            data[self.bodies] = [
                (
                    *pose.position,
                    *pose.quaternion,
                    *velocity,
                    *angular_velocity,
                    float(i == snapshot.held),
                )
                for i, (pose, velocity, angular_velocity) in enumerate(snapshot.bodies)
            ]
        return State(state.layout, data)

    def fixed_poses(self, scene: Scene, state: State) -> tuple[Pose, ...]:
        """Where each fixed body stands, in the scene's order."""
        return tuple(
            body.pose if columns is None else _pose(state.data[columns].tolist())
            for body, columns in zip(scene.fixed, self.fixed, strict=True)
        )

    def materials(self, scene: Scene, state: State) -> tuple[Material, ...]:
        """What each free body is made of, in the scene's order."""
        return tuple(
            body.material if columns is None else Material(*state.data[columns].tolist())
            for body, columns in zip(scene.free, self.material_columns, strict=True)
        )


def _pose(values: list[float]) -> Pose:
    x, y, z, qx, qy, qz, qw = values
    return Pose((x, y, z), (qx, qy, qz, qw))


def _motion(row: list[float]) -> BodyState:
    x, y, z, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz, _ = row
    return BodyState(Pose((x, y, z), (qx, qy, qz, qw)), (vx, vy, vz), (wx, wy, wz))


def _columns(layout: Layout, obj: Object, features: tuple[Feature, ...]) -> NDArray[np.intp]:
    return np.array([layout.column(obj, feature.name) for feature in features], dtype=np.intp)


def _embodied(layout: Layout, name: str) -> Object:
    obj = layout.by_name.get(name)
    if obj is None or not set(BODY_FEATURES) <= set(obj.type.features):
        raise InvalidStateError(
            f"the scene's body {name!r} is not an object with a free body's features; "
            f"the objects are {', '.join(sorted(layout.by_name))}"
        )
    return obj


def _optional(layout: Layout, name: str, features: tuple[Feature, ...]) -> NDArray[np.intp] | None:
    """Where the state has these features of a body, if it has them."""
    obj = layout.by_name.get(name)
    if obj is None or not set(features) <= set(obj.type.features):
        return None
    return _columns(layout, obj, features)
