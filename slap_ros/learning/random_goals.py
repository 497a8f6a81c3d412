# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Goals that a task might have instead of its own, drawn from what operators can reach.

A random node of a task's abstract graph, and one or two of the atoms that hold there and not at the
start (SLAP Fig. 9, D.1).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from slap_ros.core import Domain, Task
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.problem import Problem
from slap_ros.relational import AtomSpace, GroundAtom
from slap_ros.skills.domain_choice import DomainChoice

Goal = tuple[GroundAtom, ...]

MOST_ATOMS = 2  # largest number of atoms of a goal


def sample_goals(domain: Domain, task: Task, count: int, rng: np.random.Generator) -> list[Goal]:
    """Sample goals for a task's initial state, all different, none of which holds there.

    Nodes of the abstract graph, which ends where the task's own goal first holds, are taken in
    random order, each giving a goal that is not there yet, and again until there are ``count`` or
    no node has another.

    Args:
        domain: Domain of the task.
        task: Task whose initial state the goals are reached from.
        count: Number of goals at most.
        rng: Generator that chooses nodes and atoms.

    Returns:
        The goals, in the order in which they were found.

    Raises:
        UnsolvableError: Operators cannot reach the task's own goal.
        PlanningLimitError: The graph is too large.
    """
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    start = space.abstract(task.initial_state)
    graph = build_abstract_graph(start, space.mask(task.goal), problem.operators)
    waiting = [_goals_of(space, node & ~start, rng) for node in graph.nodes]
    sampled: dict[Goal, None] = {}  # a set that keeps its order
    while waiting and len(sampled) < count:
        rng.shuffle(waiting)
        left = []
        for goals in waiting:
            new = next((goal for goal in goals if goal not in sampled), None)
            if new is not None and len(sampled) < count:
                sampled[new] = None
                left.append(goals)
        waiting = left
    return list(sampled)


def _goals_of(space: AtomSpace, atoms: int, rng: np.random.Generator) -> Iterator[Goal]:
    """Every goal of one or two fluent atoms of a mask, in random order."""
    fluent = tuple(space.decode(atoms & ~space.static))
    goals = [goal for size in range(1, MOST_ATOMS + 1) for goal in combinations(fluent, size)]
    order = rng.permutation(len(goals))
    return (goals[i] for i in order)


@dataclass(frozen=True, kw_only=True)
class RandomGoalsChoice(DomainChoice):
    """A domain, some of whose tasks have another goal than their own.

    Args:
        share: Share of the tasks that have another goal, from 0 to 1.
    """

    share: float

    @classmethod
    def of_choice(cls, choice: DomainChoice, share: float) -> RandomGoalsChoice:
        """The same domain with random goals.

        Args:
            choice: Domain of the tasks.
            share: Share of the tasks that have another goal, from 0 to 1.
        """
        return cls(choice.name, choice.preset, choice.skills, choice.digest, share=share)

    @property
    def identity(self) -> dict[str, str]:
        """See :attr:`slap_ros.skills.domain_choice.DomainChoice.identity`."""
        return {**super().identity, "random_goals": str(self.share)}

    def make(self) -> Domain:
        """The domain, whose tasks begin in the same states as without other goals."""
        domain = super().make()

        def sample_task(rng: np.random.Generator) -> Task:
            task = domain.sample_task(rng)
            if rng.random() < self.share:
                with suppress(UnsolvableError, PlanningLimitError):  # then it keeps its own
                    for goal in sample_goals(domain, task, 1, rng):
                        return replace(task, goal=frozenset(goal))
            return task

        return replace(domain, sample_task=sample_task)
