# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where what all worlds compute with lies in the states of a layout."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import Feature, Layout, Object, State, Type
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES

Columns = NDArray[np.intp]


class Standing(Protocol):
    """A body that does not move."""

    @property
    def pose(self) -> Pose:
        """Pose where the state has none, in the base's frame."""
        ...


class BodyState(NamedTuple):
    """How a free body is and moves, in the base's frame."""

    pose: Pose
    velocity: Vector = ORIGIN  # m/s
    angular_velocity: Vector = ORIGIN  # rad/s

    @property
    def still(self) -> bool:
        """Whether the body has no velocity at all."""
        return self.velocity == ORIGIN and self.angular_velocity == ORIGIN


@dataclass(frozen=True, eq=False)
class LayoutIndex:
    """Where the robot and the rigid bodies of a scene lie in the states of a layout."""

    layout: Layout
    robot: Columns  # (features of the robot,)
    bodies: Columns  # (free bodies, 14)
    fixed: tuple[Columns | None, ...]  # a fixed body's pose, where the state has one

    def free_bodies(self, state: State) -> tuple[tuple[BodyState, ...], int | None]:
        """The free bodies in the scene's order, and the index of the one that is held.

        Raises:
            InvalidStateError: Two bodies are held.
        """
        rows: list[list[float]] = state.data[self.bodies].tolist()
        held = [i for i, row in enumerate(rows) if row[-1] > 0.5]
        if len(held) > 1:
            raise InvalidStateError(f"the gripper holds one body at most, here {len(held)}")
        return tuple(_body_state(row) for row in rows), held[0] if held else None

    def fixed_poses(self, fixed: Iterable[Standing], state: State) -> tuple[Pose, ...]:
        """Where each fixed body stands, in the scene's order."""
        return poses(fixed, self.fixed, state)


def robot_columns(layout: Layout, robot: Type, features: Sequence[Feature]) -> Columns:
    """Where features of the robot lie.

    Args:
        layout: Objects of the states.
        robot: Type of the robot.
        features: Features of the robot to find.

    Raises:
        InvalidStateError: Not exactly one robot.
    """
    robots = layout.of_type(robot)
    if len(robots) != 1:
        raise InvalidStateError(f"a scene has one robot, the state has {len(robots)}")
    return _columns(layout, robots[0], features)


def columns_of(
    layout: Layout, bodies: Iterable[str], features: Sequence[Feature] = BODY_FEATURES
) -> Columns:
    """Where the features of bodies lie, a row for each.

    Args:
        layout: Objects of the states.
        bodies: Names of the bodies.
        features: Features that each of them has.

    Raises:
        InvalidStateError: No object of a body's name has the features.
    """
    rows = [_columns(layout, _embodied(layout, name, features), features) for name in bodies]
    return np.array(rows, dtype=np.intp).reshape(-1, len(features))


def optional_columns(
    layout: Layout, name: str, features: Sequence[Feature] = POSE_FEATURES
) -> Columns | None:
    """Where these features of a body lie, if the state has them.

    Args:
        layout: Objects of the states.
        name: Name of the body.
        features: Features to find.
    """
    obj = layout.by_name.get(name)
    if obj is None or not set(features) <= set(obj.type.features):
        return None
    return _columns(layout, obj, features)


def poses(
    bodies: Iterable[Standing], columns: Iterable[Columns | None], state: State
) -> tuple[Pose, ...]:
    """The poses of bodies that do not move: from the state if it has them, else from the scene.

    Args:
        bodies: Bodies in the scene's order.
        columns: Columns of each body's pose in the state, None for a body without them.
        state: State to read.

    Returns:
        A pose for each body, in the base's frame.
    """
    return tuple(
        body.pose if found is None else pose_of(state.data[found].tolist())
        for body, found in zip(bodies, columns, strict=True)
    )


def pose_of(values: Sequence[float]) -> Pose:
    """The pose that the first seven values are: m, and a quaternion x y z w."""
    x, y, z, qx, qy, qz, qw = values[:7]
    return Pose((x, y, z), (qx, qy, qz, qw))


def _body_state(row: list[float]) -> BodyState:
    x, y, z, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz, _ = row
    return BodyState(Pose((x, y, z), (qx, qy, qz, qw)), (vx, vy, vz), (wx, wy, wz))


def _embodied(layout: Layout, name: str, features: Sequence[Feature]) -> Object:
    obj = layout.by_name.get(name)
    wanted = [feature.name for feature in features]
    if obj is None or not set(wanted) <= set(obj.type.column):
        raise InvalidStateError(
            f"the scene's body {name!r} is not an object with the features {', '.join(wanted)}; "
            f"the objects are {', '.join(sorted(layout.by_name))}"
        )
    return obj


def _columns(layout: Layout, obj: Object, features: Sequence[Feature]) -> Columns:
    return np.array([layout.column(obj, feature.name) for feature in features], dtype=np.intp)
