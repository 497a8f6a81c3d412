# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a mock robot moves in: the domain's world, where time passes without commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES, VELOCITY_FEATURES
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.panda import FINGER_OPEN, JOINTS, MAX_STEP

ARRIVED = 1e-6  # rad
SHUT, OPEN = 1.0, -1.0  # gripper commands


class Plant:
    """A robot and its objects. Time passes in control periods."""

    def __init__(self, domain: Domain, initial: State) -> None:
        """Begin in a state.

        Args:
            domain: Domain whose world the robot is in.
            initial: State to begin in.

        Raises:
            InvalidParameterError: The domain has no Panda.
        """
        if ROBOT not in domain.types:
            raise InvalidParameterError(f"{domain.name} has no Panda, which the mock robot is")
        self._world = domain.make_world(initial)
        (self._robot,) = initial.layout.of_type(ROBOT)
        names = [feature.name for feature in VELOCITY_FEATURES]
        self._movable = [
            obj for obj in initial.objects if {f.name for f in obj.type.features} >= set(names)
        ]
        self._shut = False

    @property
    def joints(self) -> list[float]:
        """Joint positions, rad."""
        return [float(self._world.state.get(self._robot, f.name)) for f in JOINT_FEATURES]

    @property
    def joint_velocities(self) -> list[float]:
        """None: the arm is at rest whenever it is looked at."""
        return []

    @property
    def holding(self) -> bool:
        """Whether something is in the hand."""
        return any(self._world.state.get(obj, "held") > 0.5 for obj in self._movable)

    @property
    def gap(self) -> float:
        """Distance between the fingers, m."""
        if self.holding:
            return 2.0 * float(self._world.state.get(self._robot, "finger"))
        return 0.0 if self._shut else 2.0 * FINGER_OPEN

    @property
    def at_rest(self) -> bool:
        """Whether no object moves."""
        state = self._world.state
        return all(
            state.get(obj, feature.name) == 0.0
            for obj in self._movable
            for feature in VELOCITY_FEATURES
        )

    def poses(self) -> dict[str, Pose]:
        """Where what can move is, by name."""
        found = {}
        for obj in self._movable:
            x, y, z, *turn = (float(self._world.state.get(obj, f.name)) for f in POSE_FEATURES)
            qx, qy, qz, qw = turn
            found[obj.name] = Pose((x, y, z), (qx, qy, qz, qw))
        return found

    def periods_to(self, target: Sequence[float]) -> int:
        """Control periods that a motion takes at least."""
        way = np.abs(np.subtract(target, self.joints)) / MAX_STEP
        return max(1, int(np.ceil(way.max() - ARRIVED)))

    def approach(self, target: Sequence[float]) -> None:
        """Move towards joint positions in rad for a control period; objects may be in the way."""
        way = np.subtract(target, self.joints)
        self._step(np.clip(way, np.negative(MAX_STEP), MAX_STEP), 0.0)

    def move_fingers(self, shut: bool) -> None:
        """Close the fingers, around what is between them, or open them."""
        self._step(np.zeros(JOINTS), SHUT if shut else OPEN)
        self._shut = shut

    def idle(self) -> None:
        """Let a control period pass."""
        self._step(np.zeros(JOINTS), 0.0)

    def _step(self, displacement: np.ndarray, gripper: float) -> None:
        self._world.step(np.array([*displacement, gripper]))
