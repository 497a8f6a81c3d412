# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks solved through the bridge on a mock robot: ``python -m benchmarks.robot_bridge``.

The whole ensemble, all nodes in this process, on tasks of Obstacle Tower: with the given skills
alone and with the shipped shortcuts. ``--pace`` moves the mock robot faster than a real one could;
latency stays what it is.
"""

from __future__ import annotations

import argparse
import sys
from statistics import mean

from benchmarks.printing import show
from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.robot.worlds import MOCK

DETECTION_RATE = 30.0  # Hz, at the pace of a real robot
PATIENCE = 10.0  # s, for sensors and controllers: all nodes share one process, planning too


def solve(seed: int, shortcuts: str, arguments: argparse.Namespace) -> tuple[ErrorCode, int, int]:
    """Error code, environment steps and replans of one task."""
    mock = {
        "pace": arguments.pace,
        "rate": min(DETECTION_RATE * arguments.pace, 200.0),
        "latency": arguments.latency,
        "pose_noise": arguments.pose_noise,
        "dropout": arguments.dropout,
        "noise_seed": seed,
    }
    settings = RunSettings(
        "obstacle_tower",
        "fair",
        seed,
        0,
        "lazy",
        None,
        shortcuts=shortcuts,
        world=MOCK,
        mock=mock,
        bridge={
            "joint_timeout": PATIENCE,
            "detection_timeout": PATIENCE,
            "controller_timeout": PATIENCE,
        },
    )
    try:
        metrics = run(RunRequest(settings, in_process=True), lambda _type, _message: None)
    except SlapError as error:
        print(f"seed {seed}: {error}", file=sys.stderr)
        return error.code, 0, 0
    if not metrics.success:
        print(f"seed {seed}: {metrics.error_msg}", file=sys.stderr)
    return ErrorCode(metrics.error_code), metrics.plan_length, metrics.replans


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="seed of the first task")
    parser.add_argument("--pace", type=float, default=20.0)
    parser.add_argument("--latency", type=float, default=0.02, help="s")
    parser.add_argument("--pose-noise", type=float, default=0.002, help="m")
    parser.add_argument("--dropout", type=float, default=0.0)
    parser.add_argument("--shortcuts", nargs="+", default=["none", ""], help="libraries")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = {}
    for shortcuts in arguments.shortcuts:
        seeds = range(arguments.first, arguments.first + arguments.tasks)
        found = {seed: solve(seed, shortcuts, arguments) for seed in seeds}
        solved = [(steps, replans) for code, steps, replans in found.values() if not code]
        figures[shortcuts or "shipped"] = {
            "tasks": len(found),
            "solved": len(solved),
            "mean_steps": mean(steps for steps, _ in solved) if solved else 0.0,
            "replans": sum(replans for *_, replans in found.values()),
        }
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
