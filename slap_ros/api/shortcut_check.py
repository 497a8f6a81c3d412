# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Checking whether shortcuts hold over other skills than those that they were learned over."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.core import Domain
from slap_ros.errors import (
    InvalidLibraryError,
    PlanningLimitError,
    UnsolvableError,
)
from slap_ros.files import require_writable
from slap_ros.shortcuts.holding import ShortcutTrials, trials_of, try_in_task
from slap_ros.shortcuts.shipped import skills_digest, skills_in_words
from slap_ros.shortcuts.shortcut_library import (
    ShortcutLibrary,
    load_library,
    save_library_record,
)


@dataclass(frozen=True)
class ShortcutCheck:
    """What a check of a library found.

    Args:
        library: Library that was checked.
        skills_digest: Digest of the skills that the library was checked with.
        seed: Seed of the tasks.
        tasks: Number of tasks.
        unplanned: Number of tasks that have no plan, and count for nothing.
        trials: Trials of each shortcut.
    """

    library: ShortcutLibrary
    skills_digest: str
    seed: int
    tasks: int
    unplanned: int
    trials: tuple[ShortcutTrials, ...]

    @property
    def holds(self) -> bool:
        """Whether every shortcut holds."""
        return all(trials.holds for trials in self.trials)

    @property
    def over_own_skills(self) -> bool:
        """Whether the shortcuts were learned over these skills."""
        return self.library.skills_digest == self.skills_digest

    @property
    def skills_in_words(self) -> str:
        """The skills of the check, and those that the shortcuts were learned over, in words."""
        over = skills_in_words(self.skills_digest)
        if self.over_own_skills:
            return f"{over}, which the shortcuts were learned over"
        return f"{over}; they were learned over {skills_in_words(self.library.skills_digest)}"

    def as_json(self) -> dict[str, Any]:
        """A JSON object, as the record of a library has it."""
        return {
            "skills_digest": self.skills_digest,
            "library": self.library.digest,
            "seed": self.seed,
            "tasks": self.tasks,
            "unplanned": self.unplanned,
            "shortcuts": {
                trials.name: {"states": trials.states, "reached": trials.reached}
                for trials in self.trials
            },
        }


def check_shortcuts(
    domain: Domain,
    folder: Path | str,
    *,
    tasks: int = 50,
    seed: int = 0,
    on_task: Callable[[int], None] = lambda _: None,
) -> ShortcutCheck:
    """Try a library's shortcuts over a domain's skills, and record it in the library if they hold.

    Tasks are planned for with the shortcuts. Where the planner tries a shortcut, in a state that
    a skill has left, it counts whether the shortcut reaches its target. A shortcut holds if it was
    tried, and does so from half of the states at least. If all hold, the library can be used with
    these skills from then on.

    Args:
        domain: Domain with the skills, as :func:`make` makes it.
        folder: Folder of the library of shortcuts.
        tasks: Number of tasks.
        seed: Seed of the tasks; training draws its tasks from seed 1000000 on.
        on_task: Function that receives the number of tasks that are done.

    Returns:
        What was found.

    Raises:
        InvalidLibraryError: It is no library of this domain, or none of its shortcuts can be read.
        UnsolvableError: None of the tasks has a plan.
        InvalidParameterError: The library is to be recorded in a folder that cannot be written.
    """
    path = Path(folder)
    library = load_library(path, domain)
    if not library.shortcuts:
        reasons = "; ".join(map(str, library.refused)) or "it has none"
        raise InvalidLibraryError(f"{path}: no shortcut of it can be checked: {reasons}")
    require_writable(path)
    tried = []
    for index in range(tasks):
        with suppress(UnsolvableError, PlanningLimitError):
            tried.append(try_in_task(domain, domain.task(seed, index), library.shortcuts))
        on_task(index + 1)
    if not tried:
        raise UnsolvableError(
            f"none of {tasks} tasks of {domain.name} has a plan, so no shortcut could be tried: "
            "give other --skills or another --preset"
        )
    digest, unplanned = skills_digest(domain), tasks - len(tried)
    found = ShortcutCheck(library, digest, seed, tasks, unplanned, trials_of(tried))
    if found.holds and not found.over_own_skills:
        save_library_record(path, library.checked(found.as_json()))
    return found
