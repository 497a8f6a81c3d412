# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of a curriculum between two iterations.

All of it follows from the rollouts and rounds in the work folder. So it is not written: a
curriculum that goes on reads these and comes to the same state.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from slap_ros.acquisition.curriculum.jobs import LearningJob
from slap_ros.acquisition.curriculum.solved_shares import SolvedShares
from slap_ros.acquisition.training.skill_training import Round

NEVER_JUDGED = -1.0  # below every success


@dataclass(frozen=True)
class SkillProgress:
    """The progress of the skill of one operator.

    Args:
        rounds: Number of rounds learned so far.
        success: Success rate of the best checkpoint, as last judged; below 0 before the first
            judgement.
        stale: Number of rounds in a row without progress.
        learned_from: Digest of the initiation states of the last round.
        steps: Number of environment steps learned.
        began_with: Known skill that the first round began with, and those that were tried, for
            the record.
        attempt: Number of times that the skill was learned from scratch before.
    """

    rounds: int = 0
    success: float = NEVER_JUDGED
    stale: int = 0
    learned_from: str = ""
    steps: int = 0
    began_with: Mapping[str, Any] = field(default_factory=dict)
    attempt: int = 0

    def after(self, job: LearningJob, outcome: Round) -> SkillProgress:
        """The progress with one round more, and how that went."""
        began_with = self.began_with
        if job.warm_start is not None:
            began_with = {**job.warm_start.as_json(), "success": outcome.initial}
        if job.tried:
            began_with = {**began_with, "tried": [one.as_json() for one in job.tried]}
        better = outcome.success > max(outcome.initial, self.success)
        return replace(
            self,
            rounds=self.rounds + 1,
            success=outcome.success,
            stale=0 if better else self.stale + 1,
            learned_from=job.initiations.digest,
            steps=self.steps + len(outcome.segments) * job.segment_steps,
            began_with=began_with,
        )

    def from_scratch(self) -> SkillProgress:
        """No progress, but for the steps that were spent: the skill is learned from scratch."""
        return SkillProgress(steps=self.steps, attempt=self.attempt + 1)


@dataclass
class CurriculumState:
    """The results of all iterations so far.

    Args:
        skills: Progress of each skill by the name of its operator, in the order of the operators.
        task_progress: Task progress of the rollouts of each iteration, mean over tasks.
        progress_steps: Environment steps that all skills had learned for by then.
        not_trained: Reasons why skills that failed in the last iteration were not trained, by
            operator.
        solved: Judgements of whole tasks.
    """

    skills: dict[str, SkillProgress]
    task_progress: list[float] = field(default_factory=list)
    progress_steps: list[int] = field(default_factory=list)
    not_trained: dict[str, Any] = field(default_factory=dict)
    solved: SolvedShares = field(default_factory=SolvedShares)

    @classmethod
    def initial(cls, operators: Iterable[str]) -> CurriculumState:
        """The state before the first iteration, with no skill learned."""
        return cls({name: SkillProgress() for name in operators})

    @property
    def learned(self) -> list[str]:
        """Operators whose skills were trained, in order."""
        return [name for name, skill in self.skills.items() if skill.rounds]

    @property
    def steps(self) -> int:
        """Environment steps that all skills together have learned for."""
        return sum(skill.steps for skill in self.skills.values())

    def start_over(self, names: Iterable[str]) -> None:
        """Have skills learned from scratch, each of them once more.

        Args:
            names: Names of the operators, in any number.
        """
        for name in set(names):
            self.skills[name] = self.skills[name].from_scratch()

    @property
    def improved(self) -> bool:
        """Whether plans got further in this iteration than in the one before."""
        latest = self.task_progress[-2:]
        return len(latest) == 2 and latest[1] > latest[0]
