# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What bridges to robots have in common: tasks begin in states that are measured."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from slap_msgs.srv import ResetTask

from ensemble import encode
from ensemble.endpoints import advertise
from ensemble.interfaces import MARKERS
from ensemble.lockstep_world import QUIET, LockstepWorld, P
from slap_ros.errors import InvalidStateError, SlapError
from slap_ros.relational import GroundAtom, State

REPORT_PERIOD_S = 1.0  # between two reports of why there is no task yet


class Bridge(LockstepWorld[P]):
    """A bridge to a robot, which stands in some state when it is started."""

    def __init__(self, name: str, parameters: type[P], **kwargs: Any) -> None:
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

    def _say_not_yet(self, error: SlapError, now_s: float) -> None:
        """Say from time to time why there is no task yet."""
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
