# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The work folder of a curriculum, from which the same command goes on where it was interrupted.

::

    runs/skills/points-training/
      settings.json            what is acquired
      iteration0/
        rollouts.json          plans that were carried out
        fresh.json             the same on tasks that training never sees; final.json in the last
        rounds.json            how a round of training went, per skill
      Pick/                    the training of a skill; see skill_training
      Pick-1/                  the same from scratch, after a dead end
      vacuity.json             what constant and random actions are worth
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.rollouts import PlanRollout
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.relational import LiftedOperator
from slap_ros.skills.skill_library import skill_folder_name

Compute = Callable[[], list[Any]]  # makes a result as JSON, where the folder has none


class CurriculumFolder:
    """Results of a curriculum's steps, each read where it is there and computed where it is not."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._work = WorkFolder(path)

    def require_same(self, curriculum: Mapping[str, Any]) -> None:
        """Refuse a folder with another curriculum; an empty one becomes this one's.

        Args:
            curriculum: All that its results depend on, as JSON.

        Raises:
            InvalidParameterError: The folder has another curriculum, or is damaged.
        """
        self._work.require_same(curriculum)

    def rollouts(self, iteration: int, name: str, compute: Compute) -> list[PlanRollout]:
        """The plans that were carried out in an iteration.

        Args:
            iteration: From 0.
            name: What they are for: ``rollouts``, ``fresh`` or ``final``.
            compute: Carries them out.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return self._work.cached(
            f"iteration{iteration}/{name}",
            compute,
            lambda data: [PlanRollout.from_json(one) for one in data],
        )

    def rounds(self, iteration: int, compute: Compute) -> list[Round]:
        """How the rounds of an iteration went, in the order of its skills.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return self._work.cached(
            f"iteration{iteration}/rounds",
            compute,
            lambda data: [Round.from_json(one) for one in data],
        )

    def vacuity(self, compute: Compute) -> list[Any]:
        """What policies that see nothing are worth, as JSON, in the order of the skills.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        return self._work.cached("vacuity", compute, list)

    def training(self, operator: str, attempt: int) -> Path:
        """Where the skill of an operator is trained; see ``skill_training``.

        Args:
            operator: Its name.
            attempt: How often it was learned from scratch before.
        """
        return self._path / (f"{operator}-{attempt}" if attempt else operator)

    def skill(self, operator: LiftedOperator, attempt: int) -> Path:
        """Where the best policy of a training is, as in a library.

        Args:
            operator: Whose skill.
            attempt: How often it was learned from scratch before.
        """
        return self.training(operator.name, attempt) / skill_folder_name(operator)
