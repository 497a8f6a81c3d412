# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the planner tells about a run: plans, events, feedback, and the sums in the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from slap_msgs.action import SolveTask
from slap_msgs.msg import PlanEvent

from ensemble import encode
from ensemble.interfaces import PLAN, PLAN_EVENTS
from ensemble.observation import Observation
from slap_ros.messages.decode import stamp_ns
from slap_ros.planning.options import Stopped
from slap_ros.planning.plan import Plan


class Reporter:
    """Publishes plans and plan events."""

    def __init__(self, node: Node) -> None:
        """Publish as ``node``."""
        self._node = node
        self._plans = node.create_publisher(PLAN.type, PLAN.name, PLAN.qos)
        self._events = node.create_publisher(PLAN_EVENTS.type, PLAN_EVENTS.name, PLAN_EVENTS.qos)

    def plan(
        self,
        plan: Plan,
        goal: int,
        number: int,
        at: Observation,
        origin: Mapping[str, str | int],
    ) -> None:
        """Publish the ``number``-th plan of a run, to reach the mask ``goal``."""
        space, episode = at.episode.space, at.episode.number
        self._plans.publish(encode.plan(plan, goal, space, episode, number, self._now(), origin))

    def event(self, kind: int, at: Observation, **details: Any) -> int:
        """Publish a PlanEvent; its stamp in ns."""
        header = encode.header(self._now())
        self._events.publish(
            PlanEvent(header=header, episode=at.episode.number, step=at.step, kind=kind, **details)
        )
        return stamp_ns(header)

    def _now(self) -> Any:
        return self._node.get_clock().now().to_msg()


@dataclass
class Tally:
    """The sums of a run. Durations are differences of event stamps, so that a bag has them too."""

    first_step: int
    plans: int = 0
    planning_ns: int = 0
    edges_rolled_out: int = 0

    def result(self, last_step: int, stopped: Stopped) -> SolveTask.Result:
        """The action's result."""
        return SolveTask.Result(
            success=stopped.reached,
            plan_length=last_step - self.first_step,
            replans=max(self.plans - 1, 0),
            planning_seconds=self.planning_ns / 1e9,
            edges_rolled_out=self.edges_rolled_out,
            error_code=int(stopped.code),
            error_msg=stopped.reason,
        )
