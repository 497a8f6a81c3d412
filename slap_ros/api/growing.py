# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole loop: operators, skills, shortcuts over them, skills where these shortcuts lead.

A round acquires skills and then learns shortcuts over them. From the second round on, skills are
learned from where plans with shortcuts fail. It ends when plans get no shorter.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slap_ros.api.acquisition import AcquisitionWatch, carry_out
from slap_ros.api.growth import GrowthRequest, GrowthRound, TriedShortcut
from slap_ros.api.growth_page import growth_page
from slap_ros.api.training import Unwatched, train
from slap_ros.errors import UnsolvableError
from slap_ros.files import require_writable, sole_use, write_whole
from slap_ros.learning.grown_libraries import GrownLibraries
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.policies.library_files import replace_folder
from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.jobs import VALIDATION
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.shortcuts.training_callback import TrainingCallback
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill_library import SkillLibrary

PAGE = "report.md"
UNDER_WAY = ""  # reason of a growth that has not ended


@dataclass(frozen=True)
class GrowthWatch:
    """Functions that are called while skills and shortcuts grow.

    Args:
        skills: Functions that are called while skills are acquired.
        shortcuts: Function that opens the callback for events of training shortcuts.
        on_round: Function that receives the number of each round, from 0, and what it has brought.
    """

    skills: AcquisitionWatch = field(default_factory=AcquisitionWatch)
    shortcuts: Callable[[], AbstractContextManager[TrainingCallback]] = field(
        default=lambda: nullcontext(Unwatched())
    )
    on_round: Callable[[int, GrowthRound], None] = lambda _, __: None


@dataclass(frozen=True)
class Grown:
    """What has grown.

    Args:
        rounds: Rounds, in order.
        best: Number of the best round, from 0; see
            :attr:`~slap_ros.api.growth.GrowthRound.rank`.
        ended: Reason why there is no further round, in words; empty while it goes on.
    """

    rounds: tuple[GrowthRound, ...]
    best: int
    ended: str

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {
            "rounds": [one.as_json() for one in self.rounds],
            "best": self.best,
            "ended": self.ended,
        }


def grow_rounds(
    request: GrowthRequest, jobs: int | None = None, watch: GrowthWatch = GrowthWatch()
) -> Grown:
    """Acquire skills, learn shortcuts over them, and again, until plans get no shorter.

    The libraries of the best round so far are in ``skills`` and ``shortcuts`` of the folder, beside
    the page that says what each round has brought. Interrupted, it continues where it was when it
    is called with the same request. A later round whose tasks have no plan is the last, and the
    best before it counts.

    Args:
        request: Request: what is to grow, and how.
        jobs: Number of processes; None for this one. Results do not depend on it.
        watch: Functions that are called while skills and shortcuts grow.

    Returns:
        What has grown.

    Raises:
        InvalidParameterError: The folder has another growth, or is damaged.
        UnsolvableError: With the skills of the first round, no task has a plan.
        BusyError: Another process grows in the same folder.
    """
    require_writable(request.folder)
    with sole_use(request.folder):
        work = WorkFolder(request.folder)
        work.require_same({"command": request.command})
        rounds = _finished_rounds(work)
        for number, one in enumerate(rounds):
            watch.on_round(number, one)
        while not (ended := request.why_over(rounds)):
            try:
                one = _next_round(request, work, rounds, jobs, watch)
            except UnsolvableError as error:
                if not rounds:
                    raise
                ended = f"round {len(rounds) + 1} led to nothing: {error}"
                break
            rounds.append(one)
            _save(request, Grown(tuple(rounds), _best(rounds), UNDER_WAY))
            watch.on_round(len(rounds) - 1, one)
        grown = Grown(tuple(rounds), _best(rounds), ended)
        _save(request, grown)
    return grown


def _finished_rounds(work: WorkFolder) -> list[GrowthRound]:
    """The rounds that an earlier run has finished, in order."""
    rounds: list[GrowthRound] = []
    while (work.path / f"{_round_name(len(rounds))}.json").exists():
        rounds.append(work.cached(_round_name(len(rounds)), dict, GrowthRound.from_json))
    return rounds


def _next_round(
    request: GrowthRequest,
    work: WorkFolder,
    before: Sequence[GrowthRound],
    jobs: int | None,
    watch: GrowthWatch,
) -> GrowthRound:
    """Carry out a round, and keep what it has brought.

    Args:
        request: What is to grow.
        work: Folder of all results.
        before: Earlier rounds.
        jobs: Number of processes; None for this one.
        watch: Functions that are called.

    Raises:
        UnsolvableError: With the skills of the round, no task has a plan.
    """
    return work.cached(
        _round_name(len(before)),
        lambda: _carry_out_round(request, before, jobs, watch).as_json(),
        GrowthRound.from_json,
    )


def _round_name(number: int) -> str:
    """The name of the file that says what a round has brought, without its ending.

    Args:
        number: Number of the round, from 0.
    """
    return f"round{number + 1}"


def _best(rounds: Sequence[GrowthRound]) -> int:
    """The number of the first round that no other is better than."""
    return min(range(len(rounds)), key=lambda number: rounds[number].rank)


def _carry_out_round(
    request: GrowthRequest, before: Sequence[GrowthRound], jobs: int | None, watch: GrowthWatch
) -> GrowthRound:
    """Acquire skills, and learn shortcuts over them unless they are the same as before.

    Args:
        request: What is to grow.
        before: Earlier rounds.
        jobs: Number of processes; None for this one.
        watch: Functions that are called.
    """
    left = request.steps - sum(one.steps for one in before)
    acquired = _acquire(request, len(before), left, jobs, watch)
    left -= int(acquired.record["steps"])
    if before and acquired.digest == before[-1].skills_digest:
        same = before[-1]
        return replace(_of_skills(acquired, same.length_alone, same.length), unsolved=same.unsolved)
    library, notes = _train(request, len(before), left, jobs, watch)
    validation = library.record["validation"]
    return replace(
        _of_skills(acquired, validation["pure_planning"], validation["slap"]),
        tried=tuple(_with_approaches(one, library) for one in notes.tried),
        shortcut_steps=int(library.record["environment_steps"]["spent"]),
        unsolved=notes.unsolved,
    )


def _of_skills(acquired: SkillLibrary, length_alone: float, length: float) -> GrowthRound:
    """What a round has brought in which no shortcut was learned.

    Args:
        acquired: Skills of the round.
        length_alone: Mean plan length with skills alone, environment steps.
        length: Mean plan length with shortcuts, environment steps.
    """
    record = acquired.record
    return GrowthRound(
        skills=tuple(skill.operator.name for skill in acquired.skills),
        skills_digest=acquired.digest,
        progress=float(record["progress_on_fresh_tasks"]),
        ended=str(record["ended"]),
        length_alone=length_alone,
        length=length,
        tried=(),
        skill_steps=int(record["steps"]),
        shortcut_steps=0,
    )


def _with_approaches(tried: TriedShortcut, library: ShortcutLibrary) -> TriedShortcut:
    """A shortcut that was tried, with the approaches that the library says it begins with.

    Args:
        tried: Shortcut that was tried.
        library: Library of the shortcuts that were kept.
    """
    records = {one.name: one.record for one in library.shortcuts}
    shown = records.get(tried.name, {}).get("demonstrations", {})
    return replace(tried, approaches=dict(shown.get("approaches", {})))


def _acquire(
    request: GrowthRequest, number: int, left: int, jobs: int | None, watch: GrowthWatch
) -> SkillLibrary:
    """The skills of a round, which leave environment steps for a shortcut.

    Args:
        request: What is to grow.
        number: Number of the round, from 0.
        left: Environment steps that are left.
        jobs: Number of processes; None for this one.
        watch: Functions that are called.
    """
    most = request.most_skill_steps(left)
    return carry_out(request.acquisition(number, most), jobs, watch=watch.skills)


def _train(
    request: GrowthRequest, number: int, left: int, jobs: int | None, watch: GrowthWatch
) -> tuple[ShortcutLibrary, TrainingNotes]:
    """The shortcuts of a round, and notes of what was tried.

    Args:
        request: What is to grow.
        number: Number of the round, from 0.
        left: Environment steps that are left.
        jobs: Number of processes; None for this one.
        watch: Functions that are called.
    """
    here = GrownLibraries(request.round_folder(number))
    choice = DomainChoice(request.domain.name, request.domain.preset, str(here.skills))
    with watch.shortcuts() as callback:
        notes = TrainingNotes(callback)
        library = train(
            open_domain(choice),
            here.shortcuts,
            seed=request.seed,
            settings=request.shortcut_settings,
            changes=request.affordable_changes(left),
            jobs=jobs,
            callback=notes,
        )
    return library, notes


class TrainingNotes:
    """Notes which shortcuts a training tries, and passes all events on.

    Attributes:
        tried: Shortcuts that were learned, in order.
        unsolved: Number of validation tasks without a plan.
    """

    def __init__(self, callback: TrainingCallback) -> None:
        """Begin with nothing tried.

        Args:
            callback: Receiver of all events.
        """
        self._callback = callback
        self.tried: list[TriedShortcut] = []
        self.unsolved = 0
        self.on_progress = callback.on_progress

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._callback.on_left_out(use, index, reason)
        self.unsolved += use == VALIDATION.use

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._callback.on_ranked(ranked)

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._callback.on_learning(name, folder, total_steps)

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """See :class:`~slap_ros.shortcuts.training_callback.TrainingCallback`."""
        self._callback.on_validated(name, before, after, kept)
        solved = after if math.isfinite(after) else None
        self.tried.append(TriedShortcut(name, before, solved, kept))


def _save(request: GrowthRequest, grown: Grown) -> None:
    """Write the libraries of the best round, and the page."""
    best, final = GrownLibraries(request.round_folder(grown.best)), GrownLibraries(request.folder)
    _copy(best.skills, final.skills)
    _copy(best.shortcuts, final.shortcuts)
    write_whole(request.folder / PAGE, growth_page(request, grown.rounds, grown.best, grown.ended))


def _copy(folder: Path, path: Path) -> None:
    """Write a copy of a folder in place of the one that may be there."""

    def write(draft: Path) -> None:
        shutil.copytree(folder, draft, dirs_exist_ok=True)

    replace_folder(path, write)
