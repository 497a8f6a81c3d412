# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans that language models write for the tasks of a study, without a search and a check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.core.goals import task_with_goal
from slap_ros.imitation.unchecked_plans import UncheckedPlan
from slap_ros.language.budget import BudgetLimits
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.model_attempts import (
    Attempt,
    LanguageModel,
    attempt_unchecked_plan,
)


@dataclass(frozen=True)
class WrittenPlan:
    """What a language model made of a task.

    Args:
        attempt: What was wrong with its answers, and what they cost.
        plan: Plan that it wrote.
    """

    attempt: Attempt
    plan: UncheckedPlan

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> WrittenPlan:
        """The plan that :func:`dataclasses.asdict` made such data of."""
        return cls(Attempt.from_json(data["attempt"]), UncheckedPlan.from_json(data["plan"]))

    def as_json(self) -> dict[str, Any]:
        """The plan as text, and what it cost."""
        return {
            "plan": list(map(str, self.plan.steps)),
            "unread": self.plan.unread,
            "tokens": self.attempt.tokens,
            "seconds": round(self.attempt.seconds, 1),
        }


Written = Mapping[str, Mapping[str, Sequence[WrittenPlan]]]  # by model and goal, one per task


def written_plans(
    models: Mapping[str, LanguageModel],
    choice: DomainChoice,
    goals: Sequence[str],
    tasks: tuple[int, int],
    runner: JobRunner,
) -> Written:
    """Ask every model for a plan of every task.

    Args:
        models: Language models by name.
        choice: Domain of the tasks.
        goals: Names of goals.
        tasks: Number of tasks per goal, and their seed.
        runner: Runner of the jobs; earlier answers are kept. Models cannot be sent to other
            processes, so this one asks them.

    Returns:
        The plans.
    """
    count, seed = tasks
    domain = open_domain(choice)
    problems = {
        (goal, i): AcquisitionProblem.of_task(domain, task_with_goal(domain, seed, i, goal))
        for goal in goals
        for i in range(count)
    }
    jobs = {
        _named(name, goal, i): (model, problem, i)
        for name, model in models.items()
        for (goal, i), problem in problems.items()
    }
    found = replace(runner, processes=1).run("plans", _write, WrittenPlan.from_json, jobs)
    return {
        name: {goal: [found[_named(name, goal, i)] for i in range(count)] for goal in goals}
        for name in models
    }


def _named(model: str, goal: str, index: int) -> str:
    return f"{model}: plan for {goal or 'own goal'} {index}"


def _write(model: LanguageModel, problem: AcquisitionProblem, number: int) -> WrittenPlan:
    return WrittenPlan(*attempt_unchecked_plan(model.inquiry(number, BudgetLimits()), problem))
