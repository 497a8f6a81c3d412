# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning times: ``python -m benchmarks.planning [--tasks N] [--json]``.

Obstacle Tower: pure planning of random tasks, motion planning included; and on the paper's task
the lazy search, and the whole bottom level of the graph with Dijkstra on it. Stow Hammer: A* alone
over the operators written by hand, their grounding included.
"""

from __future__ import annotations

import argparse
from statistics import fmean, stdev
from time import process_time

from benchmarks.printing import show
from slap_ros.acquisition.curriculum.rollouts import plan_operators
from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.memory import clear_caches
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.planner import make_planner


def plan(preset: str, seed: int, planner: str) -> tuple[PlanningResult, float]:
    """A plan, and the seconds of one core that it took from scratch."""
    clear_caches()
    domain = get_domain("obstacle_tower", preset)
    task = domain.task(seed)
    start = process_time()
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    made = make_planner(planner, domain, task.initial_state)
    return made.plan(task.initial_state, goal), process_time() - start


def plan_abstractly(seed: int) -> tuple[int, float]:
    """The operators of a shortest plan of Stow Hammer, and the seconds of one core."""
    domain = get_domain("stow_hammer")
    assert domain.acquisition is not None
    task, operators = domain.task(seed), domain.acquisition.operators
    start = process_time()
    _, sequence = plan_operators(domain, task, operators)
    return len(sequence), process_time() - start


def measure(tasks: int) -> dict[str, dict[str, float]]:
    """Seconds, and what was planned."""
    seconds = [plan("fair", seed, "lazy")[1] for seed in range(tasks)]
    figures: dict[str, dict[str, float]] = {
        "fair_lazy": {
            "tasks": tasks,
            "seconds_mean": fmean(seconds),
            "seconds_sd": stdev(seconds) if tasks > 1 else 0.0,
        }
    }
    abstract = [plan_abstractly(seed) for seed in range(tasks)]
    figures["stow_hammer_astar"] = {
        "operators": max(length for length, _ in abstract),
        "seconds_mean": fmean(taken for _, taken in abstract),
        "seconds_most": max(taken for _, taken in abstract),
    }
    for planner in ("lazy", "exhaustive"):
        result, taken = plan("paper", 0, planner)
        figures[f"paper_{planner}"] = {
            "seconds": taken,
            "predicted_steps": result.plan.predicted_steps,
            "graph_nodes": result.graph_nodes,
            "graph_edges": result.graph_edges,
            "edges_rolled_out": result.edges_rolled_out,
        }
    return figures


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = measure(arguments.tasks)
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
