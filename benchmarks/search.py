# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lazy against exhaustive search: ``python -m benchmarks.search [--tasks N] [--json]``."""

from __future__ import annotations

import argparse
from time import perf_counter

from benchmarks.printing import show
from slap_ros.domains import get_domain
from slap_ros.planning.planner import make_planner


def measure(tasks: int) -> dict[str, dict[str, float]]:
    """Roll-outs and seconds a task, and the mean plan length, for each planner."""
    domain = get_domain("obstacle2d")
    sums = {name: {"rollouts": 0.0, "seconds": 0.0, "plan_length": 0.0} for name in PLANNERS}
    for index in range(tasks):
        task = domain.task(0, index)
        goal = domain.atom_space(task.initial_state).mask(task.goal)
        for name, total in sums.items():
            start = perf_counter()
            planner = make_planner(name, domain, task.initial_state)
            result = planner.plan(task.initial_state, goal)
            total["seconds"] += perf_counter() - start
            total["rollouts"] += result.edges_rolled_out
            total["plan_length"] += result.plan.predicted_steps
    return {
        name: {key: value / tasks for key, value in total.items()} for name, total in sums.items()
    }


PLANNERS = ("lazy", "exhaustive", "ff")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=200)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = measure(arguments.tasks)
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
