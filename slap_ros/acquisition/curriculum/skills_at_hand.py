# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The skills that a curriculum carries plans out with: those that were learned, and kept ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState
from slap_ros.relational import LiftedOperator


@dataclass(frozen=True)
class SkillsAtHand:
    """Knows the folders of skills.

    Args:
        results: Folder of the curriculum.
        operators: All operators, by name.
        kept: Folders of the skills that were there before, by operator name.
    """

    results: CurriculumFolder
    operators: Mapping[str, LiftedOperator]
    kept: Mapping[str, str]

    def folders(self, state: CurriculumState) -> dict[str, str]:
        """The folders of the skills that were learned, or else are kept, by operator name."""
        return {**self.kept, **{name: str(self.learned(name, state)) for name in state.learned}}

    def learned(self, name: str, state: CurriculumState) -> Path:
        """The folder of a skill that was learned.

        Args:
            name: Name of the skill's operator.
            state: State of the curriculum.
        """
        return self.results.skill(self.operators[name], state.skills[name].attempt)
