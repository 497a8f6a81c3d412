# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories of skills that carry out plans: what is imitated.

The demonstrations are those of skills, not of the scripted demonstrator: a script knows all of the
state, and a policy that imitates it sees less.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import UnsolvableError
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.skills.demonstrator import DEMONSTRATION_SEED, MOST_FAILED
from slap_ros.skills.skill import LearnedSkill

Rows = NDArray[np.float32]


@dataclass(frozen=True)
class Trajectory:
    """What a skill observed and did in one stage of a plan, from its approach to its success.

    Args:
        observations: Observations, shape (steps, features).
        actions: Actions, from -1 to 1, shape (steps, actions).
    """

    observations: Rows
    actions: Rows


@dataclass(frozen=True, eq=False)
class _WatchedPolicy(MlpPolicy):
    """A policy that keeps what it observes and does."""

    seen: list[tuple[Rows, Rows]] = field(default_factory=list)

    @classmethod
    def of(cls, policy: MlpPolicy) -> _WatchedPolicy:
        """The same policy, watched."""
        return cls(
            policy.normalisation,
            policy.layers,
            policy.log_std,
            policy.activation,
            policy.squashed,
        )

    def mean(self, observations: Rows) -> Rows:
        """See :meth:`MlpPolicy.mean`."""
        actions = super().mean(observations)
        self.seen.append((observations, actions.clip(-1.0, 1.0)))
        return actions

    def take(self, steps: int) -> Trajectory:
        """What it saw and did first, which is then forgotten.

        Args:
            steps: Number of environment steps.
        """
        taken, self.seen[:] = self.seen[:steps], self.seen[steps:]
        observations, actions = zip(*taken, strict=True)
        return Trajectory(np.concatenate(observations), np.concatenate(actions))


def record_trajectories(
    domain: Domain, goal: str, skills: Mapping[str, LearnedSkill], count: int
) -> dict[str, list[Trajectory]]:
    """Let skills carry out plans until each of them has succeeded so many times.

    Args:
        domain: Domain with the operators of the skills.
        goal: Goal of the tasks, a name of the domain's or atoms; empty for each task's own.
        skills: Skills by operator name.
        count: Number of trajectories of each skill.

    Returns:
        The first trajectories of each skill, by operator name: of tasks that neither evaluation nor
        training sees, always the same ones.

    Raises:
        UnsolvableError: A skill that lacks trajectories succeeds in none of many tasks in a row.
    """
    found: dict[str, list[Trajectory]] = {name: [] for name in skills}
    index = fruitless = 0
    while lacking := {name for name, some in found.items() if len(some) < count}:
        fruitless += 1
        for name, trajectory in _of_task(domain, goal, skills, index):
            found[name].append(trajectory)
            fruitless = 0 if name in lacking else fruitless
        index += 1
        if fruitless == MOST_FAILED:
            raise UnsolvableError(
                f"{', '.join(sorted(lacking))} of {domain.name} succeeded in none of {fruitless} "
                f"tasks in a row, so there is nothing to imitate; give a goal whose plans have "
                "these skills, or a library in which they work"
            )
    return {name: some[:count] for name, some in found.items()}


def _of_task(
    domain: Domain, goal: str, skills: Mapping[str, LearnedSkill], index: int
) -> Iterator[tuple[str, Trajectory]]:
    """The stages of a task's plan that were done: operator names and trajectories."""
    policies = {name: _WatchedPolicy.of(skill.policy) for name, skill in skills.items()}
    watched = {name: replace(skill, policy=policies[name]) for name, skill in skills.items()}
    task = task_with_goal(domain, DEMONSTRATION_SEED, index, goal)
    rollout: PlanRollout = roll_out(domain, task, index, domain.operators, watched)
    for stage in rollout.stages:
        if stage.steps:
            trajectory = policies[stage.operator].take(stage.steps)
            if stage.done:
                yield stage.operator, trajectory
