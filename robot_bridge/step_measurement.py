# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state in which a step of the robot ended, once it is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from robot_bridge.robot import Robot
from slap_ros.errors import ControllerAbortedError, InvalidStateError
from slap_ros.relational import State
from slap_ros.robot.limits import Joints


class MeasurementLimits(Protocol):
    """How long a measurement may take, and how far off the arm may be."""

    settle_time: float  # s to wait for what moves to come to rest
    detection_timeout: float  # s without a state
    arrival_tolerance: float  # rad, of each joint


@dataclass(frozen=True)
class StepMeasurement:
    """One step's measurement, polled until there is a state.

    Args:
        robot: What is measured.
        limits: How long it may take.
        since_s: When the arm came to rest; s, of the robot's clock.
        target: Where the controller says that the arm went, rad.
    """

    robot: Robot
    limits: MeasurementLimits
    since_s: float
    target: Joints

    def poll(self, now_s: float) -> State | None:
        """The state, or None while it is not known yet.

        Raises:
            ControllerAbortedError: The arm is not where its controller says that it went.
            InvalidStateError: What is measured cannot be, and time is up.
            NoDetectionError: Something is not detected, and time is up.
        """
        waited = now_s - self.since_s
        late = waited > self.limits.detection_timeout
        moving = waited > self.limits.settle_time
        try:
            state = self.robot.world.measure(self.since_s, moving)
        except InvalidStateError:
            if late:
                raise
            return None
        if state is not None:
            self._require_arrival()
        elif late:
            raise self.robot.no_detection(self.since_s, f"within {self.limits.detection_timeout} s")
        return state

    def _require_arrival(self) -> None:
        off = self.robot.world.joint_distance(self.target)
        if off > self.limits.arrival_tolerance:
            raise ControllerAbortedError(
                f"the arm is {off:.3f} rad off where its controller says that it went"
            )
