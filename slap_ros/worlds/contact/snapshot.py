# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state as the contact world computes with it: plain floats, read from and written to the array.

How bodies move is a ``BodyState``, as in the other world.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Feature, Layout, Object, State
from slap_ros.worlds.contact.arm import Joints
from slap_ros.worlds.contact.features import (
    DRAWER_FEATURES,
    HAND_FEATURES,
    ROBOT,
    hand_values,
)
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.features import BODY_FEATURES, JOINT_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.snapshot import BodyState


class Opening(NamedTuple):
    """How far a jointed body is open, and how fast it opens."""

    position: float  # m or rad
    velocity: float = 0.0  # m/s or rad/s

    @property
    def still(self) -> bool:
        """Whether it has no velocity at all."""
        return self.velocity == 0.0


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
class StateIndex:
    """Where a scene's features lie in the states of a layout."""

    layout: Layout
    robot: NDArray[np.intp]  # (7 + hand,)
    bodies: NDArray[np.intp]  # (free bodies, 14)
    openings: NDArray[np.intp]  # (jointed bodies, 2)
    everything: NDArray[np.intp]  # all of the above, one after the other
    fixed: tuple[NDArray[np.intp] | None, ...]  # a fixed body's pose, where the state has one
    jointed: tuple[NDArray[np.intp] | None, ...]  # the same of a jointed body

    @staticmethod
    @lru_cache(maxsize=256)
    def of(scene: ContactScene, layout: Layout) -> StateIndex:
        """The index for a scene and a layout.

        Raises:
            InvalidStateError: Not exactly one robot, or a body that the state does not have.
        """
        robots = layout.of_type(ROBOT)
        if len(robots) != 1:
            raise InvalidStateError(f"a scene has one robot, the state has {len(robots)}")
        free = [_columns(layout, body.name, BODY_FEATURES) for body in scene.free]
        jointed = [_columns(layout, body.name, DRAWER_FEATURES) for body in scene.jointed]
        robot = _columns(layout, robots[0].name, (*JOINT_FEATURES, *HAND_FEATURES))
        return StateIndex(
            layout,
            robot,
            np.array(free, dtype=np.intp).reshape(-1, len(BODY_FEATURES)),
            np.array(jointed, dtype=np.intp).reshape(-1, len(DRAWER_FEATURES)),
            np.concatenate([robot, *free, *jointed]),
            tuple(_pose_columns(layout, body.name) for body in scene.fixed),
            tuple(_pose_columns(layout, body.name) for body in scene.jointed),
        )

    def read(self, state: State) -> ContactSnapshot:
        """The state's physics.

        Raises:
            InvalidStateError: Two bodies are held.
        """
        robot = state.data[self.robot].tolist()
        rows: list[list[float]] = state.data[self.bodies].tolist()
        held = [i for i, row in enumerate(rows) if row[-1] > 0.5]
        if len(held) > 1:
            raise InvalidStateError(f"the gripper holds one body at most, here {len(held)}")
        return ContactSnapshot(
            tuple(robot[: len(JOINT_FEATURES)]),
            _hand(robot[len(JOINT_FEATURES) :]),
            tuple(BodyState(_pose(row), _vector(row[7:10]), _vector(row[10:13])) for row in rows),
            tuple(Opening(*row) for row in state.data[self.openings].tolist()),
            held[0] if held else None,
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
            tuple(
                body.pose if columns is None else _pose(state.data[columns].tolist())
                for body, columns in zip(scene.fixed, self.fixed, strict=True)
            ),
            tuple(
                body.pose if columns is None else _pose(state.data[columns].tolist())
                for body, columns in zip(scene.jointed, self.jointed, strict=True)
            ),
        )


def _hand(values: list[float]) -> HandState:
    """A hand from the values of ``HAND_FEATURES``."""
    tx, ty, tz, yaw, left, right, left_velocity, right_velocity, gripper = values[13:]
    return HandState(
        _pose(values),
        _vector(values[7:10]),
        _vector(values[10:13]),
        (tx, ty, tz),
        yaw,
        (left, right),
        (left_velocity, right_velocity),
        gripper > 0.0,
    )


def _pose(values: list[float]) -> Pose:
    x, y, z, qx, qy, qz, qw = values[:7]
    return Pose((x, y, z), (qx, qy, qz, qw))


def _vector(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return (x, y, z)


def _columns(layout: Layout, name: str, features: tuple[Feature, ...]) -> NDArray[np.intp]:
    """Where the features of a body lie.

    Raises:
        InvalidStateError: No object of that name has them.
    """
    obj = layout.by_name.get(name)
    wanted = [feature.name for feature in features]
    if obj is None or not set(wanted) <= set(obj.type.column):
        raise InvalidStateError(
            f"the scene's body {name!r} is not an object with the features {', '.join(wanted)}; "
            f"the objects are {', '.join(sorted(layout.by_name))}"
        )
    return _indices(layout, obj, features)


def _pose_columns(layout: Layout, name: str) -> NDArray[np.intp] | None:
    """Where a body's pose lies, if the state has it."""
    obj = layout.by_name.get(name)
    if obj is None or not set(POSE_FEATURES) <= set(obj.type.features):
        return None
    return _indices(layout, obj, POSE_FEATURES)


def _indices(layout: Layout, obj: Object, features: tuple[Feature, ...]) -> NDArray[np.intp]:
    return np.array([layout.column(obj, feature.name) for feature in features], dtype=np.intp)
