# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Experiments: many tasks, planned and executed in the world (SLAP §5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slap_ros.core import Domain, Task
from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.shortcuts.workers import local_workers


@dataclass(frozen=True)
class Experiment:
    """Which tasks: ``tasks`` of each of ``seeds`` seeds, the first of which is ``first_seed``."""

    domain: Domain
    tasks: int
    seeds: int
    first_seed: int = 0
    planner: str = "lazy"

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Seed and index of each task."""
        for seed in range(self.first_seed, self.first_seed + self.seeds):
            for index in range(self.tasks):
                yield seed, index

    def __len__(self) -> int:
        return self.tasks * self.seeds

    def run(self, seed: int, index: int, approach: Approach = PURE_PLANNING) -> EpisodeResult:
        """Solve one task, in a world of its own."""
        return solve(self.domain, self.domain.task(seed, index), approach, self.planner)


def solve(domain: Domain, task: Task, approach: Approach, planner: str = "lazy") -> EpisodeResult:
    """Plan for any task of a domain and execute the plan, in a world of its own."""
    space = domain.atom_space(task.initial_state)
    return Executor(
        domain,
        approach.planner(planner, domain, task.initial_state),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
    ).run()


@dataclass(frozen=True)
class Trial:
    """What came of one task."""

    seed: int
    index: int
    success: bool
    plan_length: int  # environment steps executed
    shortcut_steps: int  # of them, those that shortcuts took
    planning_seconds: float
    edges_rolled_out: int
    reason: str  # why not, unless it is a success

    @classmethod
    def of(cls, seed: int, index: int, episode: EpisodeResult) -> Trial:
        """What an episode came to."""
        return cls(
            seed,
            index,
            episode.success,
            episode.plan_length,
            episode.shortcut_steps,
            episode.planning_seconds,
            episode.edges_rolled_out,
            episode.error.reason,
        )


def run_all(experiment: Experiment, approach: Approach, jobs: int) -> Iterator[Trial]:
    """Solve every task, ``jobs`` at a time, and tell of each as it ends.

    Every approach has processes of its own: what motion planning remembers of the same task under
    another approach would make planning look faster than it is.
    """
    domain = experiment.domain
    work = [
        (domain.name, domain.preset, experiment.planner, approach, seed, index)
        for seed, index in experiment
    ]
    with local_workers(jobs) as workers:
        for _, trial in workers.run(_try, work):
            yield trial


def _try(
    domain: str, preset: str, planner: str, approach: Approach, seed: int, index: int
) -> Trial:
    """One task; domains are made anew where this runs."""
    experiment = Experiment(get_domain(domain, preset), 1, 1, planner=planner)
    return Trial.of(seed, index, experiment.run(seed, index, approach))
