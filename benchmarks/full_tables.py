# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning for tables that fill up: ``python -m benchmarks.full_tables [--tasks N] [--json]``.

For each table, with and without the shipped shortcuts: the time until the first plan and until the
last one, their environment steps, how far from the shortest the last one can be, and how many steps
are executed where its rest is improved on the way. All times are seconds of one core in one
process, after a first plan that loads and compiles what is needed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from statistics import fmean
from time import process_time

import numpy as np

from benchmarks.printing import show
from slap_ros.core import Domain, Task
from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.memory import clear_caches
from slap_ros.errors import PlanningLimitError
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.execution import Executor
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library

FIRST_SEED = 500
TABLES = (
    ("obstacle2d", "fair"),
    ("obstacle_tower", "fair:obstacles=1"),
    ("obstacle_tower", "fair:obstacles=2"),
    ("obstacle_tower", "fair:obstacles=3"),
    ("obstacle_tower", "fair:obstacles=5"),
    ("obstacle_tower", "fair:obstacles=8"),
    ("obstacle_tower", "fair:distractors=5"),
    ("obstacle_tower", "fair:towers=3,obstacles=4,distractors=4"),
    ("cleanup_table", "fair:toys=4"),
    ("cleanup_table", "fair:toys=6"),
    ("cleanup_table", "fair:toys=8"),
    ("cluttered_drawer", "fair"),
    ("cluttered_drawer", "fair:obstacles=10"),
)


@dataclass(frozen=True)
class Figures:
    """Means over the tasks of one table.

    Args:
        tasks: Number of tasks.
        solved: Number of tasks with a plan.
        first_seconds: Time until the first plan, s.
        last_seconds: Time until planning ends, s.
        first_steps: Environment steps of the first plan.
        last_steps: Environment steps of the last plan.
        bound: How many times as long as the shortest the last plan is at most.
        rollouts: Options simulated.
        executed_steps: Environment steps executed, with the rest of the plan improved meanwhile.
    """

    tasks: int
    solved: int
    first_seconds: float
    last_seconds: float
    first_steps: float
    last_steps: float
    bound: float
    rollouts: float
    executed_steps: float


@dataclass(frozen=True)
class _Planned:
    """What came of one task."""

    first: PlanningResult
    last: PlanningResult
    first_seconds: float
    last_seconds: float
    executed_steps: int


def plan(domain: Domain, task: Task, library: str) -> _Planned | None:
    """Plan from scratch to the end of the effort; None without a plan.

    Args:
        domain: Domain of the task.
        task: Task to plan for.
        library: Choice of the shortcut library.
    """
    shortcuts, known = chosen_library(library, domain), None
    clear_caches()
    start = process_time()
    if shortcuts is not None:
        known = GroundedShortcuts(domain, shortcuts.shortcuts, task.initial_state)
    problem = Problem.of(domain, task.initial_state)
    planner = AnytimePlanner(problem, known)
    goal = problem.model.space.mask(task.goal)
    found: list[tuple[PlanningResult, float]] = []
    with suppress(PlanningLimitError):
        found.extend(
            (result, process_time() - start) for result in planner.improve(task.initial_state, goal)
        )
    taken = process_time() - start
    if not found:
        return None
    executed = execute(domain, task, planner, found[-1][0])
    return _Planned(found[0][0], found[-1][0], found[0][1], taken, executed)


def execute(domain: Domain, task: Task, planner: AnytimePlanner, planned: PlanningResult) -> int:
    """Execute a plan, with its rest improved meanwhile; the environment steps.

    Args:
        domain: Domain of the task.
        task: Task to solve.
        planner: Planner that made the plan.
        planned: The plan.

    Raises:
        RuntimeError: The goal was not reached.
    """
    world, space = domain.make_world(task.initial_state), planner.problem.model.space
    rest = (world, space, space.mask(task.goal), task.step_limit)
    episode = Executor(domain, planner, *rest, begin_with=planned).run()
    if not episode.success:
        raise RuntimeError(f"{domain.name}, seed {task.seed}: {episode.error.reason}")
    return episode.plan_length


def measure(domain: Domain, tasks: int, library: str) -> Figures:
    """Plan for the first task of so many seeds."""
    every = [plan(domain, domain.task(FIRST_SEED + i), library) for i in range(tasks)]
    found = [one for one in every if one is not None]
    return Figures(
        tasks,
        len(found),
        fmean(one.first_seconds for one in found),
        fmean(one.last_seconds for one in found),
        fmean(one.first.steps for one in found),
        fmean(one.last.steps for one in found),
        fmean(one.last.bound or np.inf for one in found),
        fmean(one.last.edges_rolled_out for one in found),
        fmean(one.executed_steps for one in found),
    )


def all_figures(tasks: int, tables: Sequence[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """The rows of the table, one after the other.

    Args:
        tasks: Number of tasks of each row.
        tables: Domains with their presets; none for all of them.
    """
    warm_up()
    for name, preset in TABLES:
        if tables and f"{name} {preset}" not in tables:
            continue
        domain = get_domain(name, preset)
        for library, word in (("none", "pure"), ("", "shortcuts")):
            yield f"{name} {preset} {word}", asdict(measure(domain, tasks, library))


def markdown(rows: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """The lines of the table of a page."""
    yield (
        "| table | shortcuts | solved | first plan | steps | last | steps | bound | roll-outs "
        "| executed |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for name, row in rows.items():
        domain, preset, word = name.split()
        yield (
            f"| `{domain}` `{preset}` | {'shipped' if word == 'shortcuts' else 'none'} "
            f"| {row['solved']:.0f} of {row['tasks']:.0f} | {row['first_seconds']:.2f} s "
            f"| {row['first_steps']:.0f} | {row['last_seconds']:.2f} s | {row['last_steps']:.0f} "
            f"| {row['bound']:.2f} | {row['rollouts']:.0f} | {row['executed_steps']:.0f} |"
        )


def warm_up() -> None:
    """Plan once, so that all is loaded and compiled."""
    domain = get_domain("obstacle_tower", "fair")
    plan(domain, domain.task(0), "")


def main() -> None:
    """Print the rows as they come, or all of them as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=5)
    parser.add_argument("--table", action="append", default=[], help="as 'cleanup_table fair'")
    parser.add_argument("--markdown", action="store_true", help="end with the table of a page")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = {}
    for row, its in all_figures(arguments.tasks, arguments.table):
        figures[row] = its
        if not arguments.json:
            numbers = ", ".join(f"{name} {value:.2f}" for name, value in its.items())
            print(f"{row}: {numbers}", flush=True)
    if arguments.markdown:
        print("\n".join(markdown(figures)))
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
