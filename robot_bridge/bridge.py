# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What bridges to robots have in common: tasks begin in states that are measured."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection, Sequence
from enum import Enum
from typing import Any, TypeVar

from builtin_interfaces.msg import Time
from slap_msgs.srv import ResetTask

from ensemble import encode
from ensemble.endpoints import advertise
from ensemble.interfaces import MARKERS
from ensemble.lockstep_world import QUIET, LockstepWorld
from ensemble.robot_parameters import BridgeParameters
from ensemble.steady_time import JumpFreeClock
from robot_bridge.sensors import Sensors
from slap_ros.errors import InvalidStateError, NoDetectionError, NoJointStateError, SlapError
from slap_ros.relational import GroundAtom, State

REPORT_PERIOD_S = 1.0  # between two reports of why there is no task yet
B = TypeVar("B", bound=BridgeParameters)


class Bridge(LockstepWorld[B]):
    """A bridge to a robot, which stands in some state when it is started.

    A subclass has clock and sensors, and enters its first phase once it has them.
    """

    _robot_clock: JumpFreeClock  # by which measurements are dated
    _sensors: Sensors
    _phase: Enum  # what it waits for
    _since_s: float  # when the phase, or the measurement of a state, began

    def __init__(self, name: str, parameters: type[B], **kwargs: Any) -> None:
        """Take the goal of the parameters.

        Args:
            name: Name of the node.
            parameters: Class of its parameters.
            kwargs: Arguments of a node.
        """
        super().__init__(name, parameters, ("unsafe_commands",), **kwargs)
        told = self._settings.first_task(self._domain) if self._settings.goal else None
        self._goal: Collection[GroundAtom] = told.goal if told is not None else ()
        self._reported_s = -math.inf  # when it was last said why there is no task yet
        self._markers = advertise(self, MARKERS)

    def _enter(self, phase: Enum) -> None:
        self._phase, self._since_s = phase, self._robot_clock.now_s()

    @property
    def _has_waited(self) -> bool:
        """Whether everything should have been there by now."""
        return self._robot_clock.now_s() - self._since_s > self._settings.detection_timeout

    @property
    def _is_idle(self) -> bool:
        """Whether nothing has come for so long that the robot holds."""
        return self._robot_clock.now_s() - self._since_s > self._settings.hold_after

    @abstractmethod
    def _no_detection(self, since_s: float) -> NoDetectionError:
        """The error that names what was not detected since a time, s."""

    def _unmeasured(self, since_s: float) -> SlapError:
        """Why there is no state since a time, s."""
        try:
            self._sensors.require_joints()
        except NoJointStateError as error:
            return error
        return self._no_detection(since_s)

    def _say_missing(self, controllers: Sequence[str], parameters: str) -> None:
        """Say what is waited for. It is no fault: a robot may be started after the bridge.

        Args:
            controllers: Actions and topics that nobody offers.
            parameters: Names of the parameters that say what these are.
        """
        self.get_logger().warning(
            f"not yet: no controller offers {', '.join(controllers)}: is it running, and are "
            f"{parameters} right?",
            throttle_duration_sec=QUIET,
        )

    def _say_not_yet(self, error: SlapError) -> None:
        """Say from time to time why there is no task yet."""
        now_s = self._robot_clock.now_s()
        if now_s - self._reported_s >= REPORT_PERIOD_S:
            self._reported_s = now_s
            self.get_logger().warning(f"not yet: {error}")
            self._publish_fault(error)

    def _require_arranged(self, request: ResetTask.Request) -> None:
        """Refuse to put a robot into a given state.

        Raises:
            InvalidStateError: The request has one.
        """
        if request.initial_state.objects:
            raise InvalidStateError(
                "a robot cannot be put into a state: arrange the objects, then reset without one"
            )

    def _show(self, state: State, stamp: Time) -> None:
        # Not as frames or joint states: those are the robot's own to publish.
        self._markers.publish(encode.SCENE.markers(self._domain.display.bodies(state), stamp))
