# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Objects of the planner's model around a simulated FR3, which is alone in its own simulation."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

from robot_bridge.mock.plant import Plant
from slap_ros.core import Domain
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.robot.franka.arm import ArmReading, FrankaArm

CATCHING_UP = 50  # control periods, at most, that the model needs beside one per measured pose
FOLLOWED = 1e-3  # rad, by which the model's joints may be off the arm's


class ModelledObjects:
    """The domain's own world, whose arm follows the measured one.

    It takes the way that the arm took, however late it is: on a busy machine, the straight way to
    where the arm is by now may lead through an object that the arm went around. What it grasps is
    attached to its hand; the arm itself never feels an object.
    """

    def __init__(self, domain: Domain, initial: State, arm: FrankaArm) -> None:
        """Begin in a state.

        Args:
            domain: Domain of the state.
            initial: State of the objects.
            arm: Arm to follow.
        """
        self._plant = Plant(domain, initial)
        self._way: deque[Sequence[float]] = deque()  # joint positions that are to be followed, rad
        self._newest: Sequence[float] = self._plant.joints  # rad, on this way or at its end
        self._see(arm.reading)
        arm.on_reading = self._see

    def follow(self) -> None:
        """Let a control period pass: the model's arm moves along the measured one's way."""
        if self._way or not self._plant.at_rest:
            self._advance()

    def grip(self, gap: float) -> float:
        """Move the model's fingers to a gap, m; the gap at which they stop, m."""
        for _ in range(len(self._way) + CATCHING_UP):
            if not self._way:
                break
            self._advance()
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

    def _see(self, reading: ArmReading) -> None:
        """Keep where the arm was read to be; called in the arm's thread."""
        if _distance(reading.joints, self._newest) > FOLLOWED:
            self._newest = reading.joints
            self._way.append(reading.joints)

    def _advance(self) -> None:
        """Move as far along the way as one control period allows."""
        target: Sequence[float] = self._way[0] if self._way else self._plant.joints
        while self._way and self._plant.periods_to(self._way[0]) == 1:
            target = self._way.popleft()
        self._plant.approach(target)


def _distance(a: Sequence[float], b: Sequence[float]) -> float:
    """How far the joint that is furthest off is from where it is elsewhere, rad."""
    return max(abs(x - y) for x, y in zip(a, b, strict=True))
