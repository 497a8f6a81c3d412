# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Objects of the planner's model around a simulated FR3, which is alone in its own simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robot_bridge.mock.plant import Plant
from slap_ros.core import Domain
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.robot.franka.arm import FrankaArm

CATCHING_UP = 50  # control periods, at most, by which the model may be behind the arm
FOLLOWED = 1e-3  # rad, by which the model's joints may be off the arm's


class ModelledObjects:
    """The domain's own world, whose arm follows the measured one.

    What it grasps is attached to its hand; the arm itself never feels an object.
    """

    def __init__(self, domain: Domain, initial: State, arm: FrankaArm) -> None:
        """Begin in a state.

        Args:
            domain: Domain of the state.
            initial: State of the objects.
            arm: Arm to follow.
        """
        self._plant, self._arm = Plant(domain, initial), arm

    def follow(self) -> None:
        """Let a control period pass: the model's arm moves to where the measured one is."""
        if self._behind > FOLLOWED or not self._plant.at_rest:
            self._plant.approach(self._arm.reading.joints)

    def grip(self, gap: float) -> float:
        """Move the model's fingers to a gap, m; the gap at which they stop, m."""
        for _ in range(CATCHING_UP):
            if self._behind <= FOLLOWED:
                break
            self._plant.approach(self._arm.reading.joints)
        self._plant.move_fingers(shut=gap < self._plant.gap)
        return max(gap, self._plant.gap if self._plant.holding else 0.0)

    def poses(self) -> Mapping[str, Pose]:
        """Where what can move is, by name."""
        return self._plant.poses()

    @property
    def joints(self) -> Sequence[float]:
        """Joint positions of the model's arm, rad."""
        return self._plant.joints

    @property
    def joint_velocities(self) -> Sequence[float]:
        """None: the model's arm is at rest whenever it is looked at."""
        return []

    @property
    def gap(self) -> float:
        """Distance between the model's fingers, m."""
        return self._plant.gap

    @property
    def _behind(self) -> float:
        """How far the joint that is furthest off is from where the arm's is, rad."""
        return max(
            abs(a - b) for a, b in zip(self._plant.joints, self._arm.reading.joints, strict=True)
        )
