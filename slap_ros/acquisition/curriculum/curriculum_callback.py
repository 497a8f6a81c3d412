# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The events of a curriculum, to be shown or recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.jobs import LearningJob
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.training.skill_training import Round, rounds_in
from slap_ros.learning.progress_callback import ProgressCallback


@dataclass(frozen=True)
class OngoingRound:
    """A round of a skill's training that has begun, maybe in another process.

    Args:
        skill: Name of the skill's operator.
        number: Number of the skill's round, from 0.
        folder: Folder of the skill's training; see
            :mod:`slap_ros.acquisition.training.skill_training`.
        steps: Environment steps of the round at most.
        segment_steps: Environment steps between two judgements.
    """

    skill: str
    number: int
    folder: Path
    steps: int
    segment_steps: int

    @classmethod
    def of(cls, job: LearningJob) -> OngoingRound:
        """The round of a job."""
        return cls(job.operator, job.number, job.folder, job.steps, job.segment_steps)

    def so_far(self) -> Round | None:
        """The round as far as it got; None before its first judgement.

        Raises:
            InvalidParameterError: The folder is damaged.
        """
        rounds = rounds_in(self.folder)
        return rounds[self.number] if self.number < len(rounds) else None


class CurriculumCallback(ProgressCallback, Protocol):
    """Receives the events of a curriculum."""

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """Plans were carried out.

        Args:
            iteration: Number of the iteration, from 0.
            rollouts: Rollouts of plans, one per task.
        """
        ...

    def on_dead_end(self, iteration: int, dead_end: DeadEnd) -> None:
        """Two skills are about to be learned from scratch.

        Args:
            iteration: Number of the iteration, from 0.
            dead_end: Dead end, with the names of both skills.
        """
        ...

    def on_learning(self, iteration: int, rounds: Sequence[OngoingRound], steps_left: int) -> None:
        """Skills are about to be learned, all of them at a time where there are the processes.

        Args:
            iteration: Number of the iteration, from 0.
            rounds: Rounds that begin, one per skill.
            steps_left: Environment steps that all skills together may still learn for.
        """
        ...

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """A skill was trained for a round.

        Args:
            iteration: Number of the iteration, from 0.
            skill: Name of the skill's operator.
            outcome: Outcome of the round.
        """
        ...
