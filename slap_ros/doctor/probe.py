# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the doctor does with rclpy, each in a process of its own.

Usage: ``python -m slap_ros.doctor.probe about | ask TOKEN | answer TOKEN``. Prints one JSON
object. ``ask`` sends numbers that ``answer`` with the same token sends back.
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ANSWER_LIMIT_S = 5.0  # for the first answer
LIFE_LIMIT_S = 45  # after which a probe ends, come what may
ROUND_TRIPS = 50
PATIENCE_S = 0.1  # for any later one
PERIOD_S = 0.02  # between questions until the first answer
DEPTH = 10  # messages kept


def about() -> dict[str, Any]:
    """Which rclpy there is, and whether it knows slap_msgs."""
    try:
        rclpy = import_module("rclpy")
    except Exception as error:  # whatever a broken installation raises is the finding
        return {"error": f"{type(error).__name__}: {error}"}
    return {
        "rclpy": rclpy.__file__,
        "embedded": _is_embedded(rclpy.__file__),
        "versions": _versions("embedded-ros", "cyclonedds"),
        "middleware": rclpy.get_rmw_implementation_identifier(),
        "slap_msgs": _import_error("slap_msgs.msg"),
    }


def ask(token: str) -> dict[str, Any]:
    """Send numbers and wait for each to come back.

    Returns:
        When the node was ready and when the first answer came (s, of the monotonic clock, which
        all processes share), and the median round trip (s).
    """
    node, end = _start("ask", token)
    string = import_module("std_msgs.msg").String
    answers: list[str] = []
    node.create_subscription(string, f"slap_doctor_{token}/answer", _keep(answers), DEPTH)
    publisher = node.create_publisher(string, f"slap_doctor_{token}/question", DEPTH)
    ready, asked = time.monotonic(), 0
    while not answers:
        if time.monotonic() - ready > ANSWER_LIMIT_S:
            end()
            return {"ready": ready, "first": None}
        asked += 1
        publisher.publish(string(data=str(asked)))
        _spin(node, PERIOD_S, lambda: bool(answers))
    first = time.monotonic()
    trips = []
    for number in map(str, range(asked + 1, asked + 1 + ROUND_TRIPS)):
        sent = time.monotonic()
        publisher.publish(string(data=number))
        if _spin(node, PATIENCE_S, partial(answers.__contains__, number)):
            trips.append(time.monotonic() - sent)
    end()
    median = statistics.median(trips) if trips else None
    return {"ready": ready, "first": first, "trips": len(trips), "median": median}


def answer(token: str) -> dict[str, Any]:
    """Send numbers back until standard input is closed.

    Returns:
        When the node was ready (s, as above).
    """
    node, end = _start("answer", token)
    string = import_module("std_msgs.msg").String
    publisher = node.create_publisher(string, f"slap_doctor_{token}/answer", DEPTH)
    node.create_subscription(string, f"slap_doctor_{token}/question", publisher.publish, DEPTH)
    ready = time.monotonic()
    closed = threading.Event()
    threading.Thread(target=_wait_for_end_of_input, args=[closed], daemon=True).start()
    while not closed.is_set():
        _spin(node, 0.1, closed.is_set)
    end()
    return {"ready": ready}


def _start(role: str, token: str) -> tuple[Any, Callable[[], None]]:
    """A node, and what ends it."""
    rclpy = import_module("rclpy")
    rclpy.init(args=[])
    node = rclpy.create_node(f"slap_doctor_{role}_{token}")

    def end() -> None:
        node.destroy_node()
        rclpy.try_shutdown()

    return node, end


def _spin(node: Any, limit_s: float, done: Callable[[], bool]) -> bool:
    """Run callbacks until ``done`` or the limit; whether it was done."""
    rclpy = import_module("rclpy")
    deadline = time.monotonic() + limit_s
    while not done():
        rest_s = deadline - time.monotonic()
        if rest_s <= 0:
            return False
        rclpy.spin_once(node, timeout_sec=rest_s)
    return True


def _wait_for_end_of_input(closed: threading.Event) -> None:
    # Not sys.stdin.read(): Python could not shut down while a thread is in it.
    while os.read(0, 1):
        pass
    closed.set()


def _keep(answers: list[str]) -> Callable[[Any], None]:
    return lambda message: answers.append(message.data)


def _is_embedded(rclpy_file: str | None) -> bool:
    try:
        ours = import_module("embedded_ros").__file__
    except ImportError:
        return False
    return bool(ours and rclpy_file and Path(rclpy_file).is_relative_to(Path(ours).parent))


def _versions(*distributions: str) -> dict[str, str]:
    found = {}
    for name in distributions:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def _import_error(module: str) -> str:
    """Why a module cannot be imported; empty where it can."""
    try:
        import_module(module)
    except Exception as error:  # as above
        return f"{type(error).__name__}: {error}"
    return ""


def main(role: str, *arguments: str) -> None:
    """Do as the role says, and print what came of it."""
    # By signal, because a thread would not get its turn while a C function hangs.
    signal.alarm(LIFE_LIMIT_S)
    roles: dict[str, Callable[..., dict[str, Any]]] = {"about": about, "ask": ask, "answer": answer}
    sys.stdout.write(json.dumps(roles[role](*arguments)) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
