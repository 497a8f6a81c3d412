# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where ``slap grow`` leaves its two libraries: side by side, after each round and at the end.

Imports nothing of learning, since nodes look for shortcuts beside the skills that they are told of.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class GrownLibraries:
    """The libraries of a growth, or of one of its rounds.

    Args:
        folder: Folder that has both.
    """

    folder: Path

    @classmethod
    def with_skills(cls, skills: Path) -> GrownLibraries:
        """Those whose skills are in a folder.

        Args:
            skills: Folder of the skills.
        """
        return cls(skills.parent)

    @property
    def skills(self) -> Path:
        """The folder of the skills."""
        return self.folder / "skills"

    @property
    def shortcuts(self) -> Path:
        """The folder of the shortcuts."""
        return self.folder / "shortcuts"
