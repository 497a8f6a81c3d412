# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How often the bound of a shortcut is wrong: ``python -m benchmarks.shortcut_bounds [DOMAIN]``.

Search counts a shortcut with half of its shortest success in training until it is rolled out. That
is an assumption: here are the states in which planning tried shortcuts with the shipped library,
those in which the shortest rollout takes less than the bound, and those in which it takes less
than the shortest success in training.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from benchmarks.printing import show
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary

DOMAINS = ("obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table")
FRESH = 2_000_000  # the seed of its tasks, which neither training nor `slap evaluate` uses


def shortest_rollouts(
    domain: Domain, library: ShortcutLibrary, index: int
) -> Iterator[tuple[int, int]]:
    """What shortcuts take wherever planning for a task tries one with success.

    Args:
        domain: Domain of the task.
        library: Library of the shortcuts.
        index: Index of the task.

    Yields:
        Environment steps of the shortest rollout from a state, and of the shortest success in
        training.
    """
    task = domain.task(FRESH, index)
    problem = Problem.of(domain, task.initial_state)
    grounded = GroundedShortcuts(domain, library.shortcuts, task.initial_state)
    planner = GraphPlanner(problem, shortcuts=grounded)
    planner.plan(task.initial_state, problem.model.space.mask(task.goal))
    shortest = {shortcut.name: shortcut.shortest for shortcut in library.shortcuts}
    for name, rollouts in grounded.cached_rollouts():
        if rollouts:
            yield rollouts[0].steps, shortest[name]


def measure(name: str, tasks: int) -> dict[str, float]:
    """Count over the first ``tasks`` tasks of a domain."""
    domain = get_domain(name)
    library = chosen_library(None, domain)
    assert library is not None  # all four domains ship one
    pairs = [p for index in range(tasks) for p in shortest_rollouts(domain, library, index)]
    return {
        "tasks": tasks,
        "states": len(pairs),
        "below_bound": sum(steps < max(1, shortest // 2) for steps, shortest in pairs),
        "below_shortest": sum(steps < shortest for steps, shortest in pairs),
        "least_ratio": min((steps / shortest for steps, shortest in pairs), default=float("nan")),
    }


def main() -> None:
    """Print the figures: a row for each domain."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain", nargs="?", choices=DOMAINS)
    parser.add_argument("--tasks", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    domains = [arguments.domain] if arguments.domain else DOMAINS
    show({name: measure(name, arguments.tasks) for name in domains}, arguments.json)


if __name__ == "__main__":
    main()
