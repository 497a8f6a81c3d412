# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A library of shortcuts to plan with, as a value that other processes can be sent."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slap_ros.core import Domain
from slap_ros.relational import State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.holding import TRIALS
from slap_ros.shortcuts.shortcut_library import load_library


@dataclass(frozen=True)
class LibraryChoice:
    """A library of shortcuts by its folder, to see where its shortcuts lead.

    Args:
        folder: Folder of the library.
        digest: Digest of the library.
    """

    folder: Path
    digest: str

    def grounded(self, domain: Domain, initial: State) -> GroundedShortcuts:
        """The shortcuts over the objects of a task.

        Args:
            domain: Domain with the skills to plan with.
            initial: State with the objects of the task.

        Raises:
            InvalidLibraryError: There is no such library any more.
        """
        shortcuts = load_library(self.folder, domain).shortcuts
        return GroundedShortcuts(domain, shortcuts, initial, TRIALS)
