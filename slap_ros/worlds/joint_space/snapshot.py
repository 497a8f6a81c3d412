# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state as the world computes with it: plain floats, read from and written to the array."""

from __future__ import annotations

from dataclasses import dataclass
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
        return self.with_bodies((*self.bodies[:index], motion, *self.bodies[index + 1 :]))

    def with_joints(self, joints: tuple[float, ...]) -> Snapshot:
        """The same snapshot with the arm elsewhere."""
        return Snapshot(joints, self.finger, self.grasp, self.held, self.bodies)

    def with_bodies(self, bodies: tuple[BodyState, ...]) -> Snapshot:
        """The same snapshot with the bodies elsewhere."""
        return Snapshot(self.joints, self.finger, self.grasp, self.held, bodies)


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

    def write(self, state: State, before: Snapshot, after: Snapshot) -> State:
        """The state with its physics replaced.

        Args:
            state: State to change.
            before: Physics of that state. What is the same object in both is not written.
            after: Physics to write.
        """
        data, grasp = state.data.copy(), after.grasp
        data[self.robot] = (*after.joints, after.finger, *grasp.position, *grasp.quaternion)
        bodies = enumerate(zip(before.bodies, after.bodies, strict=True))
        changed = [i for i, (old, new) in bodies if new is not old]
        if after.held != before.held:
            changed = list(range(len(after.bodies)))
        if changed:
            data[self.bodies[changed]] = [_row(after, i) for i in changed]
        return State(state.layout, data)

    def materials(self, scene: Scene, state: State) -> tuple[Material, ...]:
        """What each free body is made of, in the scene's order."""
        return tuple(
            body.material if columns is None else Material(*state.data[columns].tolist())
            for body, columns in zip(scene.free, self.material_columns, strict=True)
        )


def _row(snapshot: Snapshot, index: int) -> tuple[float, ...]:
    """The features of a free body."""
    (position, quaternion), velocity, turning = snapshot.bodies[index]
    return (*position, *quaternion, *velocity, *turning, float(index == snapshot.held))
