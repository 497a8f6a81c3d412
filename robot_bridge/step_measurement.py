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

ASKED = 0.02  # rad, of a joint: a shorter motion does not tell whether the arm moves
STOOD = 0.1  # share of a motion; an arm that has not gone so far has stood


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
        start: Where it was before the motion, rad.
        target: Where the controller says that the arm went, rad.
    """

    robot: Robot
    limits: MeasurementLimits
    since_s: float
    start: Joints
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

    @property
    def stood(self) -> bool | None:
        """Whether the arm has stood, as measured now; None where it was hardly told to move."""
        asked = max(abs(b - a) for a, b in zip(self.start, self.target, strict=True))
        return (
            self.robot.world.joint_distance(self.start) < STOOD * asked if asked > ASKED else None
        )

    def _require_arrival(self) -> None:
        off = self.robot.world.joint_distance(self.target)
        if off > self.limits.arrival_tolerance:
            raise ControllerAbortedError(
                f"the arm is {off:.3f} rad off where its controller says that it went"
            )
