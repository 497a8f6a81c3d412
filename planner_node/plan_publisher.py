# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans and what happens to them, as topics."""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic_ns
from typing import Any

from rclpy.node import Node
from slap_msgs.msg import PlanEvent

from ensemble import encode
from ensemble.interfaces import PLAN, PLAN_EVENTS
from ensemble.observation import Observation
from slap_ros.messages.decode import stamp_ns
from slap_ros.planning.plan import PlanningResult


class PlanPublisher:
    """Publishes plans and plan events."""

    def __init__(self, node: Node) -> None:
        """Publish as ``node``."""
        self._node = node
        self._planning: tuple[int, int] | None = None  # its start: stamp and monotonic time, ns
        self._plans = node.create_publisher(PLAN.type, PLAN.name, PLAN.qos)
        self._events = node.create_publisher(PLAN_EVENTS.type, PLAN_EVENTS.name, PLAN_EVENTS.qos)

    def plan(
        self,
        planned: PlanningResult,
        goal: int,
        number: int,
        at: Observation,
        provenance: Mapping[str, str | int],
    ) -> None:
        """Publish a plan.

        Args:
            planned: The plan, with what is proven of it.
            goal: What it is to reach, as a mask over the episode's atom space.
            number: Which plan of the run, from 0 on.
            at: Observation from which the plan starts.
            provenance: What made it, as the message has it.
        """
        space, episode = at.episode.space, at.episode.number
        self._plans.publish(
            encode.plan(planned, goal, space, episode, number, self._now(), provenance)
        )

    def event(self, kind: int, at: Observation, **details: Any) -> int:
        """Publish a PlanEvent.

        Args:
            kind: One of PlanEvent's.
            at: When: the newest observation.
            details: Other fields of the message.

        Returns:
            The event's stamp, ns since the epoch.
        """
        event = encode.plan_event(kind, at.episode.number, at.step, self._stamp(kind), **details)
        self._events.publish(event)
        return stamp_ns(event.header)

    def _stamp(self, kind: int) -> Any:
        """The stamp of an event: planning ends as long after its start as it took.

        So the difference of both is that time, also where the clock was set meanwhile.
        """
        now, started = self._node.get_clock().now(), self._planning
        if kind == PlanEvent.PLANNING_STARTED:
            self._planning = now.nanoseconds, monotonic_ns()
        elif kind in (PlanEvent.PLANNED, PlanEvent.FAILED):
            self._planning = None
            if started is not None:
                started_ns, began_ns = started
                return encode.time(started_ns + monotonic_ns() - began_ns)
        return now.to_msg()

    def _now(self) -> Any:
        return self._node.get_clock().now().to_msg()
