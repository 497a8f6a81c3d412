# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training tasks that begin near the end of demonstrations, and earlier as success rises.

A reverse curriculum (Florensa et al. 2017, Salimans and Chen 2018), as LG-SAIL's rival of that name
has it. The domain's demonstrator shows how tasks are solved; a domain without one is shown by its
own skills. Only states are taken from demonstrations, no actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from slap_ros.baselines.training_tasks import EACH, TRAINING, TaskStream, TrainingTally
from slap_ros.core import Domain, Task
from slap_ros.environments.task_env import TaskEnv
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.problem import ground_options
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain

DEMONSTRATIONS = 20
MOST_TRIED = 200  # tasks, until as many are demonstrated
WIDTH = 0.1  # share of a demonstration by which starts move, and over which they are spread
ENOUGH = 0.7  # success from which on starts move
EPISODES = 20  # over which that success is taken
SLACK, SPARE = 2, 50  # steps allowed: so many times those of the demonstration, and some to spare


@dataclass(frozen=True)
class StartingPoints:
    """A task that was solved, to begin it again on the way.

    Args:
        task: Task that was solved.
        states: States on the way, without the last one; None where there is no plan for the goal.
    """

    task: Task
    states: Sequence[State | None]

    @classmethod
    def of(cls, domain: Domain, task: Task) -> StartingPoints | None:
        """Solve a task by the domain's skills; None where they do not, or it is solved already."""
        shown = demonstrate(domain, task)
        if not shown.episode.success:
            return None
        planner = SymbolicPlanner(shown.space, ground_options(domain, shown.space))
        goal, planned = shown.space.mask(task.goal), dict[int, bool]()
        states: list[State | None] = []
        for state in shown.episode.states[:-1]:
            abstract = shown.space.abstract(state)
            if abstract not in planned:
                planned[abstract] = bool(goal & ~abstract) and _has_plan(planner, abstract, goal)
            states.append(state if planned[abstract] else None)
        return cls(task, states) if states and states[0] is not None else None

    def from_share(self, share: float) -> Task:
        """The same task from a later state on, with fewer steps allowed.

        Args:
            share: Share of the demonstration that is left to be done, from 0 to 1.
        """
        whole = len(self.states)
        number = min(whole - 1, round(whole * (1.0 - share)))
        while (state := self.states[number]) is None:
            number -= 1
        limit = min(self.task.step_limit, SLACK * (whole - number) + SPARE)
        return replace(self.task, initial_state=state, step_limit=limit)


def _has_plan(planner: SymbolicPlanner, abstract: int, goal: int) -> bool:
    try:
        planner.edges(abstract, goal)
    except (UnsolvableError, PlanningLimitError):
        return False
    return True


class ReverseCurriculum:
    """How far before the end of demonstrations episodes begin, for all environments together."""

    def __init__(self, demonstrations: Sequence[StartingPoints], tally: TrainingTally) -> None:
        """Begin near the end.

        Args:
            demonstrations: Demonstrations, one at least.
            tally: Counts of the training, from which success is taken.
        """
        self._demonstrations, self._tally = demonstrations, tally
        self._moved = 0  # episodes when starts were moved last
        self.reach = WIDTH

    def start(self, whole: Task, rng: np.random.Generator) -> Task:
        """The task of the next episode.

        Args:
            whole: Task that the episode has once starts have moved back to the beginning.
            rng: Generator that draws demonstration and state.
        """
        self._move_back()
        if self.reach > 1.0:
            return whole
        shown = self._demonstrations[int(rng.integers(len(self._demonstrations)))]
        return shown.from_share(self.reach - WIDTH * rng.uniform())

    def _move_back(self) -> None:
        """Let episodes begin earlier once enough of the last ones were solved."""
        if self._tally.episodes - self._moved < EPISODES or self.reach > 1.0:
            return
        if fmean(list(self._tally.recent)[-EPISODES:]) >= ENOUGH:
            self.reach = round(self.reach + WIDTH, 6)  # a sum of tenths would miss 1
            self._moved = self._tally.episodes


class CurriculumTasks(TaskStream):
    """The training tasks of one environment, from where the curriculum lets them begin."""

    def __init__(self, env: TaskEnv, seed: int, number: int, curriculum: ReverseCurriculum) -> None:
        """Begin before the first task.

        Args:
            env: Environment in which they must fit.
            seed: Seed of the training tasks.
            number: Number of the environment; each has tasks of its own.
            curriculum: Curriculum of all environments.
        """
        super().__init__(env, seed, number)
        self.curriculum = curriculum

    def __next__(self) -> Task:
        whole = super().__next__()
        return self.curriculum.start(whole, np.random.default_rng([self._seed, whole.index]))


def demonstrated_tasks(env: TaskEnv, seed: int, number: int) -> list[StartingPoints]:
    """Demonstrations of training tasks that no environment has.

    Args:
        env: Environment of the tasks, with their goal.
        seed: Seed of the training tasks.
        number: Number of environments, after whose tasks these come.

    Returns:
        As many as a training has, always the same.

    Raises:
        UnsolvableError: The demonstrator fails too often.
    """
    domain, indices = _with_demonstrator(env.domain), iter(TRAINING.batch(number, EACH))
    solved: list[StartingPoints] = []
    for _ in range(MOST_TRIED):
        shown = StartingPoints.of(domain, env.first_task(seed, indices))
        if shown is not None:
            solved.append(shown)
        if len(solved) == DEMONSTRATIONS:
            return solved
    raise UnsolvableError(
        f"only {len(solved)} of {MOST_TRIED} tasks of {domain.name} could be demonstrated; "
        f"{DEMONSTRATIONS} are needed to begin from"
    )


def _with_demonstrator(domain: Domain) -> Domain:
    """The domain with scripts for skills, where it has some; else as it is."""
    if domain.acquisition is None or not domain.acquisition.scripts:
        return domain
    return open_domain(DomainChoice(domain.name, domain.preset, DEMONSTRATOR))
