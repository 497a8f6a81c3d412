# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The work folder of a curriculum, from which the same command goes on where it was interrupted.

::

    runs/skills/points-training/
      settings.json            what is acquired
      iteration0/
        rollouts.json          plans that were carried out
        fresh.json             the same on tasks that training never sees; final.json in the last
        known.json             success of the known skills that new ones may begin with
        rounds.json            how a round of training went, per skill
      Pick/                    the training of a skill; see skill_training
      Pick-1/                  the same from scratch, after a dead end
      compared.json            known skills beside what was learned from them
      known/                   those known skills of other libraries that did as well
      vacuity.json             what constant and random actions are worth
      .vacuity.jsonl           jobs of a result that is under way, as they end
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.known_or_learned import KnownOrLearned
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.learning.finished_jobs import FinishedJobs, cached_jobs
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.relational import LiftedOperator
from slap_ros.skills.skill_library import skill_folder_name

Compute = Callable[[], list[Any]]  # computes a result as JSON, where the folder has none
ComputeByJobs = Callable[[FinishedJobs], list[Any]]  # the same, after the jobs that have ended


class CurriculumFolder:
    """Results of a curriculum's steps, each read where it is there and computed where it is not."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._work = WorkFolder(path)

    def require_same(self, curriculum: Mapping[str, Any]) -> None:
        """Refuse a folder with another curriculum; an empty one becomes this one's.

        Args:
            curriculum: Description of the curriculum, all that its results depend on, as JSON.

        Raises:
            InvalidParameterError: The folder has another curriculum, or is damaged.
        """
        self._work.require_same(curriculum)

    def rollouts(self, iteration: int, name: str, compute: ComputeByJobs) -> list[PlanRollout]:
        """The plans that were carried out in an iteration.

        Args:
            iteration: Number of the iteration, from 0.
            name: Purpose of the plans: ``rollouts``, ``fresh`` or ``final``.
            compute: Function that carries the plans out.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return cached_jobs(
            self._work,
            f"iteration{iteration}/{name}",
            compute,
            lambda data: [PlanRollout.from_json(one) for one in data],
        )

    def known(self, iteration: int, compute: ComputeByJobs) -> list[list[float]]:
        """The success rates of known skills in place of each new one.

        Args:
            iteration: Number of the iteration, from 0.
            compute: Function that tries the known skills.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return cached_jobs(
            self._work,
            f"iteration{iteration}/known",
            compute,
            lambda data: [[float(success) for success in one] for one in data],
        )

    def rounds(self, iteration: int, compute: Compute) -> list[Round]:
        """The rounds of an iteration, in the order of its skills.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return self._work.cached(
            f"iteration{iteration}/rounds",
            compute,
            lambda data: [Round.from_json(one) for one in data],
        )

    def compared(self, compute: Compute) -> list[KnownOrLearned]:
        """The known skills that others began with, beside what was learned from them.

        Args:
            compute: Function that tries both.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return self._work.cached(
            "compared", compute, lambda data: [KnownOrLearned(**one) for one in data]
        )

    def vacuity(self, compute: ComputeByJobs) -> list[Any]:
        """The vacuity of each skill, how well blind policies do, as JSON, in order of the skills.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return cached_jobs(self._work, "vacuity", compute, list)

    def training(self, operator: str, attempt: int) -> Path:
        """The folder in which the skill of an operator is trained; see ``skill_training``.

        Args:
            operator: Name of the operator.
            attempt: Number of times that the skill was learned from scratch before.
        """
        return self._path / (f"{operator}-{attempt}" if attempt else operator)

    def known_skill(self, operator: LiftedOperator) -> Path:
        """The folder of a known skill that does as well as what was learned from it."""
        return self._path / "known" / skill_folder_name(operator)

    def skill(self, operator: LiftedOperator, attempt: int) -> Path:
        """The folder of the best policy of a training, as in a library.

        Args:
            operator: Operator whose skill is trained.
            attempt: Number of times that the skill was learned from scratch before.
        """
        return self.training(operator.name, attempt) / skill_folder_name(operator)
