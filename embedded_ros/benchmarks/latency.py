# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Round trips between two processes: state, command, next state, and so on.

One process publishes a state of about 2 KB; the other answers each with a command of the same
size; the command's arrival triggers the next state. A round trip is two hops, each through an
executor, serialization and loopback.

    python benchmarks/latency.py --json
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import statistics
import sys
import time
from typing import Any

JOINTS = 60  # makes a sensor_msgs/JointState of about 2 KB
WARM_UP = 100  # round trips not counted
DOMAIN_ID = 149
TIMEOUT_S = 60


def joint_state() -> Any:
    """A message of about 2 KB."""
    from sensor_msgs.msg import JointState

    return JointState(
        name=[f"joint_{index}" for index in range(JOINTS)],
        position=[0.5] * JOINTS,
        velocity=[0.25] * JOINTS,
    )


def answer() -> None:
    """Answer every state with a command, until told to stop."""
    import rclpy
    from rclpy.executors import ExternalShutdownException
    from rclpy.node import Node
    from sensor_msgs.msg import JointState

    rclpy.init(args=[], domain_id=DOMAIN_ID)
    node = Node("answerer")
    commands = node.create_publisher(JointState, "command", 1)
    node.create_subscription(JointState, "state", commands.publish, 1)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


class Asker:
    """Publishes a state, waits for the command, and so on; takes the times."""

    def __init__(self, round_trips: int) -> None:
        from rclpy.node import Node
        from rclpy.task import Future
        from sensor_msgs.msg import JointState

        self.node = Node("asker")
        self.done = Future()
        self.times_ms: list[float] = []
        self._wanted = round_trips + WARM_UP
        self._message = joint_state()
        self._states = self.node.create_publisher(JointState, "state", 1)
        self.node.create_subscription(JointState, "command", self._on_command, 1)

    def connected(self) -> bool:
        """Whether both directions are matched."""
        return (
            self._states.get_subscription_count() > 0 and self.node.count_publishers("command") > 0
        )

    def ask(self) -> None:
        """Publish the next state."""
        self._sent = time.perf_counter()
        self._states.publish(self._message)

    def _on_command(self, message: Any) -> None:
        self.times_ms.append((time.perf_counter() - self._sent) * 1e3)
        if len(self.times_ms) < self._wanted:
            self.ask()
        else:
            self.done.set_result(None)


def measure(round_trips: int) -> dict[str, float]:
    """Measure round trips against another process."""
    import rclpy
    from rclpy.serialization import serialize_message

    answerer = multiprocessing.get_context("spawn").Process(target=answer)
    answerer.start()
    rclpy.init(args=[], domain_id=DOMAIN_ID)
    asker = Asker(round_trips)
    try:
        deadline = time.monotonic() + TIMEOUT_S
        while not asker.connected():
            if time.monotonic() > deadline:
                raise TimeoutError("the other process was not discovered")
            time.sleep(0.05)
        time.sleep(0.5)  # the other direction's discovery
        asker.ask()
        rclpy.spin_until_future_complete(asker.node, asker.done, timeout_sec=TIMEOUT_S)
        if not asker.done.done():
            raise TimeoutError(f"{len(asker.times_ms)} round trips in {TIMEOUT_S} s")
    finally:
        answerer.terminate()
        answerer.join()
        asker.node.destroy_node()
        rclpy.try_shutdown()
    times = sorted(asker.times_ms[WARM_UP:])
    return {
        "round_trips": len(times),
        "message_bytes": len(serialize_message(joint_state())),
        "median_ms": round(statistics.median(times), 4),
        "p99_ms": round(times[int(0.99 * len(times))], 4),
        "max_ms": round(times[-1], 4),
        "cpu_count": os.cpu_count() or 1,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--round-trips", type=int, default=1000)
    arguments = parser.parse_args()
    figures = measure(arguments.round_trips)
    if arguments.json:
        json.dump(figures, sys.stdout)
        print()
    else:
        for name, value in figures.items():
            print(f"{name:15} {value}")


if __name__ == "__main__":
    main()
