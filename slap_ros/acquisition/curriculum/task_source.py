# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The source of the tasks that skills are acquired for, as data for other processes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from slap_ros.core import Domain, Task
from slap_ros.core.goals import task_with_goal
from slap_ros.learning.task_distribution import TRAINING_SEED
from slap_ros.learning.task_range import TaskRange
from slap_ros.relational import LiftedOperator, RewardTemplate
from slap_ros.skills.domain_choice import NO_SKILLS, DomainChoice
from slap_ros.skills.operator_json import operator_data, read_operator, read_template, template_data

# Tasks that plans are carried out in, other ones in each iteration.
ROLLOUTS = TaskRange("rollouts", 0, 900_000)
# Tasks that skills are judged on, none of which is trained on. They are other ones in each
# iteration, too: else a checkpoint that was lucky with them would stay for good.
VALIDATION = TaskRange("validation", 900_000)


@dataclass(frozen=True)
class TaskSource:
    """Tasks of one goal in a domain, and the operators to solve them with.

    Args:
        domain: Domain of the tasks, without skills.
        goal: Goal of the tasks, a name of the domain's or atoms; empty for each task's own.
        seed: Seed of all random numbers.
        proposal: Operators and rewards of the proposal, as JSON.
    """

    domain: DomainChoice
    goal: str
    seed: int
    proposal: str

    @classmethod
    def of(
        cls,
        domain: Domain,
        goal: str,
        seed: int,
        operators: tuple[LiftedOperator, ...],
        rewards: Mapping[str, RewardTemplate],
    ) -> TaskSource:
        """The source of a domain's tasks.

        Args:
            domain: Domain of the tasks; its own skills, if any, are left out.
            goal: Goal of the tasks, a name of the domain's or atoms; empty for each task's own.
            seed: Seed of all random numbers.
            operators: Operators to plan with.
            rewards: Reward templates by operator name.
        """
        pairs = [(operator_data(o), template_data(rewards[o.name])) for o in operators]
        choice = DomainChoice(domain.name, domain.preset, NO_SKILLS)
        return cls(choice, goal, seed, json.dumps(pairs))

    def make_domain(self) -> Domain:
        """The domain, in this process."""
        return self.domain.make()

    def task(self, index: int) -> Task:
        """A task that evaluation never uses."""
        return task_with_goal(self.make_domain(), TRAINING_SEED + self.seed, index, self.goal)

    def operators(self) -> tuple[LiftedOperator, ...]:
        """The operators, in order."""
        return tuple(operator for operator, _ in _read(self))

    def rewards(self) -> dict[str, RewardTemplate]:
        """The rewards by operator name."""
        return {operator.name: template for operator, template in _read(self)}

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {
            "domain": self.domain.name,
            "preset": self.domain.preset,
            "goal": self.goal,
            "seed": self.seed,
            "proposal": json.loads(self.proposal),
        }


@lru_cache(maxsize=64)
def _read(source: TaskSource) -> tuple[tuple[LiftedOperator, RewardTemplate], ...]:
    domain, pairs = source.make_domain(), []
    for operator, template in json.loads(source.proposal):
        read = read_operator(operator, domain)
        pairs.append((read, read_template(template, read, domain)))
    return tuple(pairs)
