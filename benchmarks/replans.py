# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One planner that plans again and again: ``python -m benchmarks.replans [DOMAIN] [--replans N]``.

A robot that is disturbed replans with the planner that it has. What that one keeps of earlier plans
is limited (:mod:`slap_ros.planning.model`), so that its memory stops growing. Printed are resident
memory and roll-outs after each tenth of the replans, each from another state of the same objects.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import count, islice

import psutil

from benchmarks.printing import show
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.problem import Problem
from slap_ros.relational import State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library

SEED = 500
MIB = 2**20


def starts(domain: Domain) -> Iterator[State]:
    """States of the same objects, one after the other."""
    first = domain.task(SEED).initial_state
    states = (domain.task(SEED, index).initial_state for index in count())
    return (state for state in states if state.layout == first.layout)


def replan(name: str, replans: int, with_shortcuts: bool) -> dict[str, dict[str, float]]:
    """Memory in MiB and roll-outs by the number of replans.

    Args:
        name: Name of the domain.
        replans: Number of replans.
        with_shortcuts: Whether to plan with the shortcuts that ship.
    """
    domain = get_domain(name, "fair")
    task = domain.task(SEED)
    folder = shipped_library(name) if with_shortcuts else None
    learned = load_library(folder, domain).shortcuts if folder else ()
    shortcuts = GroundedShortcuts(domain, learned, task.initial_state) if learned else None
    problem = Problem.of(domain, task.initial_state)
    planner, goal = AnytimePlanner(problem, shortcuts), problem.model.space.mask(task.goal)
    process, found, unsolved = psutil.Process(), {}, 0
    for number, state in enumerate(islice(starts(domain), replans), start=1):
        try:
            planner.plan(state, goal)
        except (UnsolvableError, PlanningLimitError):
            unsolved += 1
        if number % max(1, replans // 10) == 0:
            found[str(number)] = {
                "memory_mib": process.memory_info().rss / MIB,
                "rolled_out": problem.model.executed,
                "unsolved": unsolved,
            }
    return found


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain", nargs="?", default="obstacle_tower")
    parser.add_argument("--replans", type=int, default=1000)
    parser.add_argument("--shortcuts", action="store_true", help="plan with those that ship")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    show(replan(given.domain, given.replans, given.shortcuts), given.json)


if __name__ == "__main__":
    main()
