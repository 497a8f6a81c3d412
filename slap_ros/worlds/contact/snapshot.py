# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state as the contact world computes with it: plain floats, read from and written to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slap_ros.geometry.pose import Pose
from slap_ros.relational import Layout, State
from slap_ros.worlds.contact.arm import Joints
from slap_ros.worlds.contact.features import DRAWER_FEATURES, ROBOT, hand_values
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.layout_index import (
    BodyState,
    Columns,
    LayoutIndex,
    columns_of,
    optional_columns,
    pose_of,
    poses,
    robot_columns,
)


class Opening(NamedTuple):
    """How far a jointed body is open, and how fast it opens."""

    position: float  # m or rad
    velocity: float = 0.0  # m/s or rad/s

    @property
    def still(self) -> bool:
        """Whether the opening has no velocity at all."""
        return self.velocity == 0.0


def stopped_at_ends(position: float, velocity: float, high: float) -> tuple[float, float]:
    """A joint's position and velocity, stopped at its ends, which engines let it overrun.

    Args:
        position: Position, m or rad; the least is 0.
        velocity: Velocity, m/s or rad/s.
        high: Largest position, m or rad.
    """
    if position < 0.0:
        return 0.0, max(velocity, 0.0)
    if position > high:
        return high, min(velocity, 0.0)
    return position, velocity


class Placement(NamedTuple):
    """Where those bodies stand that do not move, in the order of the scene."""

    fixed: tuple[Pose, ...]
    jointed: tuple[Pose, ...]


class ContactSnapshot(NamedTuple):
    """Everything contact physics knows of a state."""

    joints: Joints  # rad, of the arm
    hand: HandState
    bodies: tuple[BodyState, ...]  # the scene's free bodies
    openings: tuple[Opening, ...]  # of its jointed bodies
    held: int | None = None  # index among the free bodies


@dataclass(frozen=True, eq=False)
class ContactIndex(LayoutIndex):
    """Where a scene's features lie: of the robot its joints and its hand."""

    openings: Columns  # (jointed bodies, 2)
    everything: Columns  # robot, bodies and openings, one after the other
    jointed: tuple[Columns | None, ...]  # a jointed body's pose, where the state has one

    @staticmethod
    @lru_cache(maxsize=256)
    def of(scene: ContactScene, layout: Layout) -> ContactIndex:
        """The index for a scene and a layout.

        Raises:
            InvalidStateError: Not exactly one robot, or a body that the state does not have.
        """
        robot = robot_columns(layout, ROBOT, ROBOT.features)
        bodies = columns_of(layout, [body.name for body in scene.free])
        jointed = [body.name for body in scene.jointed]
        openings = columns_of(layout, jointed, DRAWER_FEATURES)
        return ContactIndex(
            layout,
            robot,
            bodies,
            tuple(optional_columns(layout, body.name) for body in scene.fixed),
            openings,
            np.concatenate([robot, bodies.ravel(), openings.ravel()]),
            tuple(optional_columns(layout, name) for name in jointed),
        )

    def read(self, state: State) -> ContactSnapshot:
        """The state's physics.

        Raises:
            InvalidStateError: Two bodies are held.
        """
        robot = state.data[self.robot].tolist()
        bodies, held = self.free_bodies(state)
        return ContactSnapshot(
            tuple(robot[: len(JOINT_FEATURES)]),
            _hand(robot[len(JOINT_FEATURES) :]),
            bodies,
            tuple(Opening(*row) for row in state.data[self.openings].tolist()),
            held,
        )

    def write(self, state: State, snapshot: ContactSnapshot) -> State:
        """The state with its physics replaced."""
        values = [*snapshot.joints, *hand_values(snapshot.hand)]
        for i, body in enumerate(snapshot.bodies):
            values += body.pose.position
            values += body.pose.quaternion
            values += body.velocity
            values += body.angular_velocity
            values.append(1.0 if i == snapshot.held else 0.0)
        for opening in snapshot.openings:
            values += opening
        data = state.data.copy()
        data[self.everything] = values
        return State(state.layout, data)

    def placement(self, scene: ContactScene, state: State) -> Placement:
        """Where the bodies stand that do not move."""
        return Placement(
            self.fixed_poses(scene.fixed, state), poses(scene.jointed, self.jointed, state)
        )


def _hand(values: list[float]) -> HandState:
    """A hand from the values of ``HAND_FEATURES``."""
    tx, ty, tz, yaw, left, right, left_velocity, right_velocity, gripper = values[13:]
    return HandState(
        pose_of(values),
        _vector(values[7:10]),
        _vector(values[10:13]),
        (tx, ty, tz),
        yaw,
        (left, right),
        (left_velocity, right_velocity),
        gripper > 0.0,
    )


def _vector(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return (x, y, z)
