# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that the tests start in another process, written as any rclpy node is."""

from __future__ import annotations

import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
REJECTED_ORDER, FAILING_ORDER = 60, 13
HELD_ORDER = 40  # stops halfway until it is cancelled
TOLD_ORDER = 6  # ends when there is a line on standard input


class Echo(Node):
    """Answers every message on ``in`` with the same on ``out``."""

    def __init__(self) -> None:
        super().__init__("echo")
        self._publisher = self.create_publisher(String, "out", 100)
        self.create_subscription(String, "in", self._publisher.publish, 100)


class Latched(Node):
    """Publishes five latched messages before anybody listens."""

    def __init__(self) -> None:
        super().__init__("latched")
        self._publisher = self.create_publisher(String, "plan", LATCHED)
        for index in range(5):
            self._publisher.publish(String(data=str(index)))


class Adder(Node):
    """Adds two integers, asynchronously where the first is negative."""

    def __init__(self) -> None:
        super().__init__("adder")
        self.create_service(AddTwoInts, "add", self._add)
        self._status = self.create_publisher(DiagnosticStatus, "status", 10)

    async def _add(
        self, request: AddTwoInts.Request, response: AddTwoInts.Response
    ) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response


class Counter(Node):
    """The usual Fibonacci action server."""

    RESULT_TIMEOUT_S = 900

    def __init__(self) -> None:
        super().__init__("counter")
        self._server = ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self._execute,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=lambda goal: (
                GoalResponse.REJECT if goal.order == REJECTED_ORDER else GoalResponse.ACCEPT
            ),
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            result_timeout=self.RESULT_TIMEOUT_S,
        )

    def _execute(self, handle) -> Fibonacci.Result:
        if handle.request.order == FAILING_ORDER:
            raise RuntimeError("this order fails")
        sequence = [0, 1]
        for index in range(1, handle.request.order):
            while index == HELD_ORDER // 2 and not handle.is_cancel_requested:
                time.sleep(0.01)
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[index] + sequence[index - 1])
            handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            time.sleep(0.02)
        if handle.request.order == TOLD_ORDER:
            input()
        handle.succeed()
        return Fibonacci.Result(sequence=sequence)


class Forgetful(Counter):
    """One that keeps results for a moment only."""

    RESULT_TIMEOUT_S = 1


class Parametrized(Node):
    """Has parameters."""

    def __init__(self) -> None:
        super().__init__("parametrized")
        self.declare_parameter("rate", 10.0)
        self.declare_parameter("names", ["a", "b"])
        self.declare_parameter("count", 3)
        values = {p: self.get_parameter(p).value for p in ("rate", "names", "count")}
        print(f"{self.get_fully_qualified_name()} {values}", flush=True)


NODES = {
    cls.__name__.lower(): cls for cls in (Echo, Latched, Adder, Counter, Forgetful, Parametrized)
}


def main() -> None:
    rclpy.init(args=sys.argv)
    node = NODES[sys.argv[1]]()
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    print("ready", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
