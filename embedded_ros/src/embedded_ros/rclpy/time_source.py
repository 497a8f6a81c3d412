# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated time: the ``use_sim_time`` parameter and the ``/clock`` topic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from embedded_ros.types import message_class

from .callback_groups import MutuallyExclusiveCallbackGroup
from .clock import ROSClock
from .duration import NANOSECONDS_PER_SECOND
from .parameter import Parameter
from .qos import QoSProfile, ReliabilityPolicy

if TYPE_CHECKING:
    from .node import Node
    from .subscription import Subscription

USE_SIM_TIME_NAME = "use_sim_time"
CLOCK_TOPIC = "/clock"


class TimeSource:
    """Drives a node's clock from ``/clock`` while its ``use_sim_time`` is true."""

    def __init__(self, node: Node, clock: ROSClock) -> None:
        self._node = node
        self._clock = clock
        self._subscription: Subscription[Any] | None = None
        # Of its own: no other callback may hold simulated time up.
        self._group = MutuallyExclusiveCallbackGroup()
        if not node.has_parameter(USE_SIM_TIME_NAME):
            node.declare_parameter(USE_SIM_TIME_NAME, False)
        self._apply(bool(node.get_parameter(USE_SIM_TIME_NAME).value))
        node.add_on_set_parameters_callback(self._validate)
        node.add_post_set_parameters_callback(self._on_set)

    @property
    def ros_time_is_active(self) -> bool:
        """Whether time is simulated."""
        return self._clock.is_simulated

    def _validate(self, parameters: list[Parameter]) -> Any:
        result: Any = message_class("rcl_interfaces/msg/SetParametersResult")(successful=True)  # type: ignore[call-arg]
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME_NAME and parameter.type_ != Parameter.Type.BOOL:
                result.successful = False
                result.reason = f"'{USE_SIM_TIME_NAME}' parameter is not of type bool"
        return result

    def _on_set(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME_NAME:
                self._apply(bool(parameter.value))

    def _apply(self, simulated: bool) -> None:
        if simulated and self._subscription is None:
            self._clock.set_override(0)  # until told
            self._subscription = self._node.create_subscription(
                message_class("rosgraph_msgs/msg/Clock"),
                CLOCK_TOPIC,
                self._on_clock,
                QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
                callback_group=self._group,
            )
        elif not simulated and self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
            self._clock.set_override(None)

    def _on_clock(self, message: Any) -> None:
        stamp = message.clock
        self._clock.set_override(stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec)
