# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training a library of shortcuts."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from os.path import relpath
from pathlib import Path
from typing import Any

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.jobs import require_torch, some_workers
from slap_ros.api.library_descriptions import describe_skills
from slap_ros.api.setting_texts import Changes, change_texts
from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.files import sole_use
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.planning.problem import require_skills
from slap_ros.policies.library_files import SHORTCUT, require_places
from slap_ros.shortcuts.approaches import require_sides
from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shipped import require_same_skills
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary, load_library, save_library
from slap_ros.shortcuts.subgoals import SubgoalTraining
from slap_ros.shortcuts.training import Training
from slap_ros.shortcuts.training_callback import TrainingCallback
from slap_ros.skills.domain_choice import WORDS, DomainChoice
from slap_ros.whole_numbers import require_whole


class Unwatched:
    """Receives the events of a training, and does nothing with them."""

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""


@checks_arguments
def train(
    domain: Domain,
    folder: Path | str,
    *,
    seed: int = 0,
    settings: str = "ours",
    changes: Changes = (),
    steps: int | None = None,
    work: Path | str | None = None,
    jobs: int | None = None,
    ray: str | None = None,
    callback: TrainingCallback | None = None,
    keep: Path | str | None = None,
) -> ShortcutLibrary:
    """Discover and learn shortcuts: explore, rank, train, keep what makes plans shorter.

    Interrupted, it continues where it was when it is called with the same arguments.

    Args:
        domain: Domain to train in, as :func:`make` makes it.
        folder: Folder that the library is saved to.
        seed: Seed of all random numbers.
        settings: Name of the hyper-parameters, as ``slap train --help`` has them.
        changes: Settings to change, by dotted name, as ``{"exploration.rollouts": 16}``; or texts
            as on the command line.
        steps: Environment steps per shortcut; None for those of the settings.
        work: Folder for checkpoints; None for one beside the library's folder.
        jobs: Number of processes; None for this one. A script that uses processes needs
            ``if __name__ == "__main__"``.
        ray: Address of a Ray cluster to run on instead, or ``local``.
        callback: Receiver of the events of training.
        keep: Library of an earlier training, whose shortcuts are used and kept; None for none.

    Returns:
        The library, which :func:`plan` takes as ``shortcuts``.

    Raises:
        NoSkillsError: The domain has no skills to begin with.
        InvalidParameterError: Torch is not installed, a setting cannot be what it is to be, or the
            folder has something that is no library.
        InvalidLibraryError, SkillsChangedError: The library to keep is damaged, another domain's,
            or was learned over other skills.
        BusyError: Another process trains in the same folder.
    """
    require_skills(domain)
    require_whole("seed", seed)
    chosen = chosen_settings(domain, settings, changes, steps)
    kept = () if keep is None else _shortcuts_to_keep(Path(keep), domain)
    work_folder = training_folder(folder, work)
    require_places(Path(folder), work_folder, SHORTCUT)
    require_torch()
    choice, watched = DomainChoice.opened_as(domain), callback or Unwatched()
    tasks = TaskDistribution(choice, seed)
    with sole_use(work_folder), some_workers(jobs, ray) as workers:
        kind = SubgoalTraining if chosen.together > 1 else Training
        library = kind(tasks, chosen, work_folder, workers, watched, kept).run()
    command = train_command(choice, seed, settings, steps, change_texts(changes), keep)
    library = _with_origin(library, command, domain)
    save_library(Path(folder), library)
    return library


def _with_origin(library: ShortcutLibrary, command: str, domain: Domain) -> ShortcutLibrary:
    """The library, whose record begins with the command that made it, and over which skills."""
    made_by: dict[str, Any] = {"command": command}
    if acquired := describe_skills(domain):
        made_by["skills"] = acquired
    return replace(library, record={**made_by, **library.record})


def training_folder(library: Path | str, work: Path | str | None) -> Path:
    """Where checkpoints and logs are, by default beside the library."""
    folder = Path(library)
    return Path(work) if work is not None else folder.with_name(f"{folder.name}-training")


def chosen_settings(
    domain: Domain, name: str, changes: Changes, steps: int | None
) -> TrainingSettings:
    """The hyper-parameters of a training.

    Args:
        domain: Domain to train in, which may have settings of its own.
        name: Name of the settings.
        changes: Settings to change.
        steps: Environment steps per shortcut; None for those of the settings.

    Raises:
        InvalidParameterError: There are none of that name, they cannot be changed so, or they
            explore approaches, of which the domain has none.
        InvalidDomainError: See :func:`~slap_ros.shortcuts.named_settings.training_settings`.
    """
    chosen = training_settings(name, domain)
    parsed = parse_changes(change_texts(changes), TrainingSettings)
    if steps is not None:
        require_whole("steps", steps, least=1)
    if steps is not None and (both := [n for n in parsed if n.endswith("total_steps")]):
        raise InvalidParameterError(f"--steps and --set {both[0]} say the same: give one")
    chosen = changed(chosen, parsed)
    if chosen.exploration.approaches:
        require_sides(domain)
    return chosen if steps is None else chosen.with_total_steps(steps)


def train_command(
    choice: DomainChoice,
    seed: int,
    settings: str,
    steps: int | None,
    changes: Sequence[str],
    keep: Path | str | None = None,
) -> str:
    """The command that trains the same library again.

    Args:
        choice: Domain and skills.
        seed: Seed of all random numbers.
        settings: Name of the settings.
        steps: Environment steps per shortcut, if they are given.
        changes: Settings to change, as texts.
        keep: Library of an earlier training whose shortcuts are kept, if there is one.
    """
    command = f"slap train {choice.name} --preset {choice.preset}{skills_option(choice.skills)}"
    given = "" if steps is None else f" --steps {steps}"
    sets = "".join(f" --set {shlex.quote(text)}" for text in changes)
    kept = "" if keep is None else f" --keep {shlex.quote(relpath(keep))}"
    return f"{command} --seed {seed} --settings {settings}{given}{sets}{kept}"


def _shortcuts_to_keep(folder: Path, domain: Domain) -> tuple[Shortcut, ...]:
    """All shortcuts of a library, which must be whole and learned over the domain's skills."""
    library = load_library(folder, domain)
    for refused in library.refused:
        raise refused
    require_same_skills(library, domain, str(folder))
    if not library.shortcuts:
        raise InvalidLibraryError(f"{folder}: there is no shortcut in it that could be kept")
    return library.shortcuts


def skills_option(skills: str) -> str:
    """The option ``--skills`` as a part of commands; never an absolute path."""
    name = skills if skills in WORDS else relpath(skills)
    return f" --skills {shlex.quote(name)}" if skills else ""
