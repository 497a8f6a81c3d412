# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans that acquired skills carry out, and the task progress of several libraries."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any, NamedTuple

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.core import Domain, task_with_goal
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread
from slap_ros.skills.domain_choice import DomainChoice, chosen_skills, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.studies.job_runner import JobRunner

# Task progress that LG-SAIL's Table 1 has, by domain and goal.
PAPER_PROGRESS: Mapping[tuple[str, str], float] = {
    ("stack_at_target", "training"): 1.00,
    ("stow_hammer", "training"): 0.96,
    ("stow_hammer", "test1"): 0.91,
    ("stow_hammer", "test2"): 0.71,
    ("peg_in_hole", "training"): 0.92,
    ("peg_in_hole", "test1"): 0.59,
    ("peg_in_hole", "test2"): 0.93,
}


class Origin(NamedTuple):
    """Where operators and rewards of a library are from, by name."""

    proposer: str
    rewarder: str


@dataclass(frozen=True)
class LibraryProgress:
    """What came of a goal's tasks with one library.

    Args:
        digest: Digest of the library.
        seed: Seed that the library was trained with.
        rollouts: Rollouts of the plans, one per task.
    """

    digest: str
    seed: int
    rollouts: tuple[PlanRollout, ...]

    @property
    def progress(self) -> float:
        """Mean task progress."""
        return fmean(rollout.progress for rollout in self.rollouts)

    @property
    def failures(self) -> Counter[str]:
        """Stages that failed, by operator, and plans that do not lead to the goal, by reason."""
        failed = [rollout for rollout in self.rollouts if rollout.progress < 1.0]
        return Counter(r.failure.operator if r.failure else _reason(r) for r in failed)

    def as_json(self) -> dict[str, Any]:
        """The summary, and every task: of each stage operator, environment steps, why it failed."""
        return {
            "library": self.digest,
            "seed": self.seed,
            "progress": self.progress,
            "failures": dict(self.failures),
            "tasks": list(map(_task_in_words, self.rollouts)),
        }


def _reason(rollout: PlanRollout) -> str:
    """Why there is no plan, without the objects of the task."""
    return rollout.unplanned.partition(":")[0]


def _task_in_words(rollout: PlanRollout) -> dict[str, Any]:
    stages = list(map(_in_words, rollout.stages))
    why = {"unplanned": rollout.unplanned} if rollout.unplanned else {}
    return {"progress": rollout.progress, "stages": stages, **why}


def _in_words(stage: Stage) -> str:
    failed = "" if stage.done else f": {stage.end}"
    return f"{stage.operator} {stage.steps}{failed}"


@dataclass(frozen=True, kw_only=True)
class LibrariesProgress:
    """Several libraries at one goal.

    Args:
        domain: Name of the domain.
        goal: Name of the goal; empty for the goal that comes with each task.
        libraries: Progress with each library, one at least.
    """

    domain: str
    goal: str
    libraries: tuple[LibraryProgress, ...]

    @property
    def rollouts(self) -> list[PlanRollout]:
        """The rollouts of all libraries."""
        return [rollout for library in self.libraries for rollout in library.rollouts]

    @property
    def progress(self) -> Spread:
        """Mean task progress, over libraries."""
        return Spread.of([library.progress for library in self.libraries])

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks whose stages were all done."""
        done = sum(rollout.progress == 1.0 for rollout in self.rollouts)
        return SuccessRate(done, len(self.rollouts))

    @property
    def failures(self) -> str:
        """What failed of all libraries, in words: see :attr:`LibraryProgress.failures`."""
        failures = sum((library.failures for library in self.libraries), Counter[str]())
        return ", ".join(f"{name} {count}" for name, count in failures.most_common()) or "none"


def of_library(
    choice: DomainChoice, goal: str, indices: Sequence[int], seed: int, runner: JobRunner
) -> tuple[Origin, LibraryProgress]:
    """Where a library is from, and what comes of a goal's tasks with it.

    Args:
        choice: Domain with the skills of the library.
        goal: Name of the goal; empty for the goal that comes with each task.
        indices: Indices of the tasks.
        seed: Seed of the tasks.
        runner: Runner of the jobs.
    """
    library = chosen_skills(choice)
    assert library is not None
    record = library.record
    origin = Origin(*(str(record.get(name, "manual")) for name in Origin._fields))
    jobs = {f"{goal} {library.digest} {i}": (choice, goal, seed, i) for i in indices}
    rollouts = runner.run(goal or choice.name, carry_out_task, PlanRollout.from_json, jobs)
    trained = int(record.get("seed", 0))
    return origin, LibraryProgress(library.digest, trained, tuple(rollouts.values()))


def carry_out_task(choice: DomainChoice, goal: str, seed: int, index: int) -> dict[str, Any]:
    """Carry out one task's plan.

    Args:
        choice: Domain with the skills of a library.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.

    Returns:
        A :class:`~slap_ros.acquisition.curriculum.plan_rollout.PlanRollout` as JSON, without
        states.
    """
    domain = open_domain(choice)
    return carry_out(domain, goal, seed, index, learned_skills(domain))


def learned_skills(domain: Domain) -> dict[str, LearnedSkill]:
    """The skills of a domain that were learned, by operator name."""
    return {n: skill for n, skill in domain.skills.items() if isinstance(skill, LearnedSkill)}


def carry_out(
    domain: Domain, goal: str, seed: int, index: int, skills: Mapping[str, LearnedSkill]
) -> dict[str, Any]:
    """Carry out one task's plan with given skills.

    Args:
        domain: Domain with the operators to plan with.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.
        skills: Skills by operator name.

    Returns:
        A :class:`~slap_ros.acquisition.curriculum.plan_rollout.PlanRollout` as JSON, without
        states.
    """
    task = task_with_goal(domain, seed, index, goal)
    return without_states(roll_out(domain, task, index, domain.operators, skills))


def without_states(rollout: PlanRollout) -> dict[str, Any]:
    """A rollout as JSON, without the states in which skills began."""
    return replace(rollout, stages=tuple(replace(s, state=()) for s in rollout.stages)).as_json()
