# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state as the world computes with it: plain floats, read from and written to the array."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.relational import Layout, State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.joint_space.features import MATERIAL_FEATURES, ROBOT
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.layout_index import (
    BodyState,
    Columns,
    LayoutIndex,
    columns_of,
    optional_columns,
    pose_of,
    robot_columns,
)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything physics knows of a state."""

    joints: tuple[float, ...]  # rad
    finger: float  # m
    grasp: Pose  # the held body in the hand's frame
    held: int | None  # index among the scene's free bodies
    bodies: tuple[BodyState, ...]  # the scene's free bodies

    def moved(self, index: int, motion: BodyState) -> Snapshot:
        """The same snapshot with one body elsewhere."""
        bodies = (*self.bodies[:index], motion, *self.bodies[index + 1 :])
        return replace(self, bodies=bodies)


@dataclass(frozen=True, eq=False)
class SceneIndex(LayoutIndex):
    """Where a scene's features lie: of the robot its joints, its finger and its grasp."""

    material_columns: tuple[Columns | None, ...]  # a free body's material, where it has one

    @staticmethod
    @lru_cache(maxsize=256)
    def of(scene: Scene, layout: Layout) -> SceneIndex:
        """The index for a scene and a layout.

        Raises:
            InvalidStateError: Not exactly one robot, or a free body that the state does not have.
        """
        return SceneIndex(
            layout,
            robot_columns(layout, ROBOT, ROBOT.features),
            columns_of(layout, [body.name for body in scene.free]),
            tuple(optional_columns(layout, body.name) for body in scene.fixed),
            tuple(optional_columns(layout, body.name, MATERIAL_FEATURES) for body in scene.free),
        )

    def read(self, state: State) -> Snapshot:
        """The state's physics.

        Raises:
            InvalidStateError: Two bodies are held.
        """
        *joints, finger, x, y, z, qx, qy, qz, qw = state.data[self.robot].tolist()
        bodies, held = self.free_bodies(state)
        grasp = IDENTITY if held is None else pose_of((x, y, z, qx, qy, qz, qw))
        return Snapshot(tuple(joints), finger, grasp, held, bodies)

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

    def materials(self, scene: Scene, state: State) -> tuple[Material, ...]:
        """What each free body is made of, in the scene's order."""
        return tuple(
            body.material if columns is None else Material(*state.data[columns].tolist())
            for body, columns in zip(scene.free, self.material_columns, strict=True)
        )
