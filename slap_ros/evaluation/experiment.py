# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Experiments: many tasks, planned and executed in the world, summed up (SLAP §5)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any

from slap_ros.domains import Domain
from slap_ros.planning.execution import Episode, Executor
from slap_ros.planning.planner import make_planner

PURE_PLANNING = "pure_planning"


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

    def run(self, seed: int, index: int) -> Episode:
        """Solve one task by pure planning, in a world of its own."""
        task = self.domain.task(seed, index)
        space = self.domain.atom_space(task.initial_state)
        return Executor(
            self.domain,
            make_planner(self.planner, self.domain, task.initial_state),
            self.domain.make_world(task.initial_state),
            space,
            space.mask(task.goal),
            task.step_limit,
        ).run()


@dataclass(frozen=True)
class Spread:
    """Mean and sample standard deviation over tasks."""

    mean: float
    sd: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """The spread of at least one value."""
        return cls(fmean(values), stdev(values) if len(values) > 1 else 0.0)


@dataclass(frozen=True)
class Summary:
    """What an experiment came to."""

    experiment: Experiment
    approach: str
    success_rate: float
    plan_length: Spread | None  # environment steps executed, over solved tasks; None: none solved
    relative_length: float | None  # mean length over that of pure planning on the same tasks
    planning_seconds: Spread
    edges_rolled_out: float  # mean

    @classmethod
    def of_pure_planning(cls, experiment: Experiment, episodes: Sequence[Episode]) -> Summary:
        """The summary of pure planning, which is its own yardstick."""
        lengths = [float(episode.plan_length) for episode in episodes if episode.success]
        return cls(
            experiment,
            PURE_PLANNING,
            fmean(episode.success for episode in episodes),
            Spread.of(lengths) if lengths else None,
            1.0 if lengths else None,
            Spread.of([episode.planning_seconds for episode in episodes]),
            fmean(episode.edges_rolled_out for episode in episodes),
        )

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        length = self.plan_length
        return {
            "domain": self.experiment.domain.name,
            "preset": self.experiment.domain.preset,
            "approach": self.approach,
            "tasks": self.experiment.tasks,
            "seeds": self.experiment.seeds,
            "success_rate": self.success_rate,
            "plan_length": {
                "mean": length.mean if length else None,
                "sd": length.sd if length else None,
            },
            "relative_length": self.relative_length,
            "planning_seconds": {
                "mean": self.planning_seconds.mean,
                "sd": self.planning_seconds.sd,
            },
            "edges_rolled_out": {"mean": self.edges_rolled_out},
        }
