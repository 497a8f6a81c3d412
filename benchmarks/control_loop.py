# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Latency of the control loop: ``python -m benchmarks.control_loop [--steps N] [--json]``.

``state_command_state``: a simulator process and this one; each step is a command sent and the
next state received. ``ensemble``: all nodes in processes of their own; each step passes the
simulator, perception and the skill server, and is measured between the stamps of its states.
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import pairwise
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from slap_msgs.msg import ObjectCentricState, RobotCommand

from benchmarks.printing import show
from ensemble.interfaces import COMMAND, STATE
from ensemble.launcher import ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.run import RunRequest, run
from slap_ros.bags import read_bag
from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.interfaces import STATE as STATE_TYPE
from slap_ros.skills.domain_choice import DomainChoice

RUNS = 10  # of the whole ensemble


class Stepper:
    """Answers every state with a command and notes how long the next one takes."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("control_loop")
        self.milliseconds: list[float] = []
        self._expected = 0  # step of the next state
        self._sent: float | None = None  # s; None before the first command
        self._commands = self.node.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        self.node.create_subscription(STATE.type, STATE.name, self._on_state, STATE.qos)

    def connected(self) -> bool:
        """Whether the simulator hears commands."""
        return bool(self._commands.get_subscription_count())

    def _on_state(self, state: ObjectCentricState) -> None:
        if self._sent is not None and state.step == self._expected:
            self.milliseconds.append((perf_counter() - self._sent) * 1e3)
            self.command(state.step)

    def command(self, step: int) -> None:
        """Ask for a small move, up and down in turn."""
        self._expected = step + 1
        up = 0.01 if step % 2 else -0.01
        self._sent = perf_counter()
        self._commands.publish(RobotCommand(episode=1, step=step, deltas=[0.0, up], gripper=0.0))


def state_command_state(steps: int) -> list[float]:
    """Milliseconds of each step."""
    rclpy.init()
    executor, stepper = SingleThreadedExecutor(), Stepper()
    executor.add_node(stepper.node)
    settings = RunSettings(DomainChoice("obstacle2d", "fair"), 0, 0, "lazy", None)
    with ProcessLauncher({"sim_node": node_parameters(settings)["sim_node"]}):
        while not stepper.connected():
            executor.spin_once(timeout_sec=0.1)
        stepper.command(0)
        while len(stepper.milliseconds) < steps:
            executor.spin_once(timeout_sec=0.1)
    stepper.node.destroy_node()
    executor.shutdown()
    rclpy.shutdown()
    return stepper.milliseconds


def ensemble() -> list[float]:
    """Milliseconds between states of recorded runs."""
    gaps = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(RUNS):
            bag = Path(folder) / str(seed)
            run(
                RunRequest(RunSettings(DomainChoice("obstacle2d", "fair"), seed, 0, "lazy", bag)),
                lambda _type, _message: None,
            )
            states: list[Any] = [m for _, kind, _, m in read_bag(bag) if kind == STATE_TYPE]
            stamps = [stamp_ns(state.header) for state in states]
            gaps += [(b - a) / 1e6 for a, b in pairwise(stamps[1:])]
    return gaps


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    measured = {
        "state_command_state": state_command_state(arguments.steps),
        "ensemble": ensemble(),
    }
    figures = {
        name: {
            "steps": len(values),
            "median_ms": median(values),
            "p99_ms": quantiles(values, n=100)[-1],
        }
        for name, values in measured.items()
    }
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
